#pragma once

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <concepts>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/result.hpp"

/// Writes a Config as text, one line `name value` for each member, and reads it again in the process at the other end
/// of a socket. Both directions use the list of members in the Config's visit(). An optional without a value has no
/// line.
namespace hueline::drivers {

namespace detail {

inline void put(std::string& out, const std::string& value) {
  for (const char c : value) {
    if (c == '\n' || c == '\\') out += '\\';
    out += c == '\n' ? 'n' : c;
  }
}
template <class T>
requires std::is_arithmetic_v<T>
void put(std::string& out, T value) { out += fmt::format("{}", value); }
template <class T>
requires std::is_enum_v<T>
void put(std::string& out, T value) { out += fmt::format("{}", static_cast<std::uint64_t>(value)); }
template <class Rep, class Period>
void put(std::string& out, std::chrono::duration<Rep, Period> value) {
  out += fmt::format("{}", value.count());
}

inline bool get(std::string_view text, std::string& value) {
  value.clear();
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && ++i == text.size()) return false;
    value += text[i] == 'n' && i > 0 && text[i - 1] == '\\' ? '\n' : text[i];
  }
  return true;
}
template <class T>
requires(std::is_arithmetic_v<T> && !std::same_as<T, bool>) bool get(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}
inline bool get(std::string_view text, bool& value) {
  value = text == "true";
  return value || text == "false";
}
template <class T>
requires std::is_enum_v<T>
bool get(std::string_view text, T& value) {
  std::underlying_type_t<T> number{};
  if (!get(text, number)) return false;
  value = static_cast<T>(number);
  return true;
}
template <class Rep, class Period>
bool get(std::string_view text, std::chrono::duration<Rep, Period>& value) {
  Rep count{};
  if (!get(text, count)) return false;
  value = std::chrono::duration<Rep, Period>(count);
  return true;
}
template <class T>
bool get(std::string_view text, std::optional<T>& value) {
  return get(text, value.emplace());
}

}  // namespace detail

/// Returns the members of `config` as text.
template <class Config>
std::string write_config(const Config& config) {
  std::string out;
  const auto line = [&out](std::string_view name, const auto& value) {
    out += name;
    out += ' ';
    detail::put(out, value);
    out += '\n';
  };
  Config::visit(config, [&]<class T>(std::string_view name, const T& value) {
    if constexpr (requires { value.has_value(); }) {
      if (value) line(name, *value);
    } else {
      line(name, value);
    }
  });
  return out;
}

/// Reads the members from text; members without a line keep their default. Error: Malformed, if a line names no member
/// or its value is not of the member's type. The message says which.
template <class Config>
Result<Config> read_config(std::string_view text) {
  std::map<std::string_view, std::string_view> lines;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::size_t space = line.find(' ');
    if (space == std::string_view::npos)
      return Error{ErrorCode::Malformed, fmt::format("'{}' is no name with a value", line)};
    lines[line.substr(0, space)] = line.substr(space + 1);
  }
  Config config;
  std::string wrong;
  Config::visit(config, [&](std::string_view name, auto& value) {
    const auto found = lines.extract(name);
    if (!found.empty() && !detail::get(found.mapped(), value))
      wrong = fmt::format("{}: '{}' is no value of it", name, found.mapped());
  });
  if (!lines.empty()) wrong = fmt::format("{}: no such member", lines.begin()->first);
  if (!wrong.empty()) return Error{ErrorCode::Malformed, std::move(wrong)};
  return config;
}

}  // namespace hueline::drivers
