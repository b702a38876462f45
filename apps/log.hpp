#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace hueline::apps {

/// Log messages of the program on stderr, one line a call, with time and level. spdlog is included by log.cpp alone,
/// because its headers compile a whole formatting library into every file that includes them. Thread-safe.
void log_info(std::string_view line);
void log_warning(std::string_view line);
void log_error(std::string_view line);

template <class First, class... Rest>
void log_info(fmt::format_string<First, Rest...> format, First&& first, Rest&&... rest) {
  log_info(fmt::format(format, std::forward<First>(first), std::forward<Rest>(rest)...));
}
template <class First, class... Rest>
void log_warning(fmt::format_string<First, Rest...> format, First&& first, Rest&&... rest) {
  log_warning(fmt::format(format, std::forward<First>(first), std::forward<Rest>(rest)...));
}
template <class First, class... Rest>
void log_error(fmt::format_string<First, Rest...> format, First&& first, Rest&&... rest) {
  log_error(fmt::format(format, std::forward<First>(first), std::forward<Rest>(rest)...));
}

/// Sets the form of a line: time, coloured level, text; for the journal of systemd the text with its level. Call it
/// once, before the first message.
void set_up_log();

}  // namespace hueline::apps
