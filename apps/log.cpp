#include "apps/log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "core/printable.hpp"

namespace hueline::apps {

void log_info(std::string_view line) { spdlog::info("{}", printable(line, LineEnds::Keep)); }
void log_warning(std::string_view line) { spdlog::warn("{}", printable(line, LineEnds::Keep)); }
void log_error(std::string_view line) { spdlog::error("{}", printable(line, LineEnds::Keep)); }

void set_up_log() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("hueline"));
  spdlog::set_pattern("%H:%M:%S %^%l%$ %v");
}

}  // namespace hueline::apps
