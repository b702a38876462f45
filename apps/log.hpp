#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace hueline::apps {

/// What the program says of itself, on stderr, with time and level: one line a call. spdlog behind one file, for its
/// headers compile whole formatting code into each that includes them. Thread-safe.
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

/// Time, level in colour, text. Once, before anything is said.
void set_up_log();

}  // namespace hueline::apps
