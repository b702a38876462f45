#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/number_word.hpp"
#include "core/result.hpp"
#include "drivers/can/can_frame.hpp"

/// What the readers of text logs of CAN buses share: numbers, times, ids and bytes.
namespace hueline::drivers::can_words {

/// Reads a time such as "12.345678" exactly, whose unit has as many nanoseconds as 1 with `places` zeros.
inline bool decimal(std::string_view word, std::size_t places, std::chrono::nanoseconds& out) {
  const std::size_t dot = word.find('.');
  if (dot == std::string_view::npos || dot == 0 || word[0] == '-') return false;
  std::string digits(word.substr(dot + 1));
  if (digits.empty() || digits.size() > places) return false;
  digits.resize(places, '0');
  std::int64_t ns = 0;
  if (!read_number(std::string(word.substr(0, dot)) + digits, ns) || ns > 9'000'000'000'000'000'000) return false;
  out = std::chrono::nanoseconds(ns);
  return true;
}

/// Reads seconds such as "12.345678".
inline bool seconds(std::string_view word, std::chrono::nanoseconds& out) { return decimal(word, 9, out); }

inline Error bad(std::string_view line, std::string_view what) {
  return {ErrorCode::Malformed, fmt::format("{} in '{}'", what, line.substr(0, 80))};
}

/// Reads the digits of an id; `is_extended` is set already.
inline bool take_digits(std::string_view word, int base, CanFrame& frame) {
  return read_number(word, frame.id, base) && frame.id <= (frame.is_extended ? 0x1FFFFFFFU : 0x7FFU);
}

/// Reads the first words as bytes of two hex digits each. Returns what is wrong; nothing if they are the frame's data.
inline std::string_view take_bytes(std::span<const std::string_view> words, std::size_t count, CanFrame& frame) {
  if (words.size() < count) return "a frame without its data";
  for (std::size_t i = 0; i < count; ++i)
    if (words[i].size() != 2 || !read_number(words[i], frame.data[i], 16)) return "a byte that is none";
  frame.length = static_cast<std::uint8_t>(count);
  return {};
}

}  // namespace hueline::drivers::can_words
