#include "apps/log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "core/printable.hpp"

namespace hueline::apps {

namespace {

/// Returns whether standard error goes to the journal of systemd, which gives each line its time and takes its level
/// from a prefix (sd-daemon(3)).
bool goes_to_journal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat own {};
  return stream != nullptr && fstat(STDERR_FILENO, &own) == 0 && fmt::format("{}:{}", own.st_dev, own.st_ino) == stream;
}

void log(spdlog::level::level_enum level, int journal_level, std::string_view line) {
  static const bool is_journal = goes_to_journal();
  std::string text = printable(line, LineEnds::Keep);
  if (is_journal) {
    const std::string prefix = fmt::format("<{}>", journal_level);
    text.insert(0, prefix);
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 1 + prefix.size())
      text.insert(at + 1, prefix);
  }
  spdlog::log(level, "{}", text);
}

}  // namespace

void log_info(std::string_view line) { log(spdlog::level::info, 6, line); }
void log_warning(std::string_view line) { log(spdlog::level::warn, 4, line); }
void log_error(std::string_view line) { log(spdlog::level::err, 3, line); }

void set_up_log() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("hueline"));
  spdlog::set_pattern(goes_to_journal() ? "%v" : "%H:%M:%S %^%l%$ %v");
}

}  // namespace hueline::apps
