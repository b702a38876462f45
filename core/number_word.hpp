#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace hueline {

/// Reads the number of which a word consists. Returns false if there is anything else in the word, no number, or one
/// that T cannot hold; `out` may then have changed. Points stand for decimals whatever the computer's language is.
template <class T>
bool read_number(std::string_view word, T& out) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc() && end == word.data() + word.size();
}
/// The same for whole numbers of another base, such as 16.
template <class T>
bool read_number(std::string_view word, T& out, int base) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out, base);
  return error == std::errc() && end == word.data() + word.size();
}

/// Returns the number of which a word consists, or nothing where read_number() returns false.
template <class T>
std::optional<T> parse_number(std::string_view word) {
  T out{};
  return read_number(word, out) ? std::optional(out) : std::nullopt;
}

}  // namespace hueline
