#include "drivers/can/can_log_table.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "core/base64.hpp"
#include "core/line_words.hpp"
#include "core/number_word.hpp"
#include "drivers/can/can_errors.hpp"
#include "drivers/can/can_log_words.hpp"

namespace hueline::drivers {
namespace {

using can_words::bad;
using can_words::decimal;
using can_words::seconds;
using can_words::take_bytes;
using can_words::take_digits;

/// Splits a row at its commas; values may be empty.
std::vector<std::string_view> values_of_row(std::string_view line) {
  std::vector<std::string_view> out;
  for (;;) {
    const std::size_t comma = line.find(',');
    std::string_view value = line.substr(0, comma);
    while (!value.empty() && std::isspace(static_cast<unsigned char>(value.front()))) value.remove_prefix(1);
    while (!value.empty() && std::isspace(static_cast<unsigned char>(value.back()))) value.remove_suffix(1);
    out.push_back(value);
    if (comma == std::string_view::npos) return out;
    line.remove_prefix(comma + 1);
  }
}

/// The name of a column as it is compared: without blanks and underscores, in small letters.
std::string plain_name(std::string_view name) {
  std::string out;
  for (const char c : name)
    if (c != ' ' && c != '_') out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

/// Reads a flag of a table: 0, 1, true or false.
bool take_flag(std::string_view word, bool& flag) {
  const std::string plain = plain_name(word);
  flag = plain == "1" || plain == "true";
  return flag || plain == "0" || plain == "false";
}

}  // namespace

bool CanLogTable::take_head(std::string_view line) {
  if (line.starts_with("***")) {
    if (line.starts_with("***BUSMASTER Ver")) {
      *this = {};
      kind_ = Kind::Busmaster;
    }
    if (kind_ != Kind::Busmaster) return false;
    if (line.starts_with("***DEC")) is_hex_ = false;
    if (line.starts_with("***RELATIVE MODE")) is_relative_ = true;
    if (line.starts_with("***PROTOCOL ")) is_can_ = line.starts_with("***PROTOCOL CAN*");
    return true;
  }
  return kind_ == Kind::None && line.find(',') != std::string_view::npos && take_names(line);
}

/// Takes the names of a table's columns. Returns false if they are not those of a log of a CAN bus.
bool CanLogTable::take_names(std::string_view line) {
  static const std::map<std::string, Column, std::less<>> kNames = {
      {"timestamp", Column::Time},    {"id", Column::Id},         {"arbitrationid", Column::Id},
      {"extended", Column::Extended}, {"remote", Column::Remote}, {"error", Column::Broken},
      {"dir", Column::Direction},     {"bus", Column::Bus},       {"len", Column::Length},
      {"dlc", Column::Length},        {"data", Column::Base64}};
  std::vector<Column> columns;
  for (const std::string_view value : values_of_row(line)) {
    const std::string name = plain_name(value);
    const auto found = kNames.find(name);
    unsigned number = 0;
    const bool is_byte = name.starts_with('d') && read_number(std::string_view(name).substr(1), number);
    columns.push_back(found != kNames.end() ? found->second : is_byte ? Column::Byte : Column::Other);
  }
  const auto has = [&](Column column) { return std::ranges::find(columns, column) != columns.end(); };
  if (!has(Column::Time) || !has(Column::Id) || !has(Column::Extended) || !has(Column::Length) ||
      has(Column::Byte) == has(Column::Base64))
    return false;
  *this = {};
  kind_ = Kind::Csv;
  columns_ = std::move(columns);
  return true;
}

/// Returns a time of a clock that starts again after `turn`, without its steps back.
nanoseconds CanLogTable::going_on(nanoseconds time, nanoseconds turn) {
  if (time < last_ - turn / 2) turns_ += turn;
  last_ = time;
  return time + turns_;
}

Result<std::optional<CanLogEntry>> CanLogTable::take(std::string_view line) {
  return kind_ == Kind::Csv ? take_row(line) : take_busmaster(line);
}

Result<std::optional<CanLogEntry>> CanLogTable::take_row(std::string_view line) {
  const auto values = values_of_row(line);
  CanLogEntry out;
  CanFrame& frame = out.frame;
  std::string_view time, id, base64_text;
  std::vector<std::string_view> bytes;
  std::size_t length = 0;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::string_view value = i < values.size() ? values[i] : std::string_view();
    switch (columns_[i]) {
      case Column::Time:
        time = value;
        break;
      case Column::Id:
        id = value;
        break;
      case Column::Extended:
        if (!take_flag(value, frame.is_extended)) return bad(line, "no true or false under 'extended'");
        break;
      case Column::Remote:
        if (!take_flag(value, frame.is_remote)) return bad(line, "no true or false under 'remote'");
        break;
      case Column::Broken:
        if (!take_flag(value, frame.is_error)) return bad(line, "no true or false under 'error'");
        break;
      case Column::Direction:
        frame.is_local = plain_name(value) == "tx";
        break;
      case Column::Bus:
        if (!read_number(value, frame.bus)) return bad(line, "no number of the bus");
        break;
      case Column::Length:
        if (!read_number(value, length) || length > kCanDataMost) return bad(line, "no length");
        break;
      case Column::Byte:
        bytes.push_back(value);
        break;
      case Column::Base64:
        base64_text = value;
        break;
      case Column::Other:
        break;
    }
  }
  std::int64_t microseconds = 0;
  if (read_number(time, microseconds) && microseconds >= 0 && microseconds < 9'000'000'000'000'000)
    out.time = going_on(std::chrono::microseconds(microseconds), std::chrono::microseconds(std::int64_t{1} << 32));
  else if (!seconds(time, out.time))
    return bad(line, "no time");
  if (frame.is_error) {
    frame = broken_frame(frame.bus);
    return std::optional(out);
  }
  if (id.starts_with("0x") || id.starts_with("0X")) id.remove_prefix(2);
  if (!take_digits(id, 16, frame)) return bad(line, "no id");
  if (frame.is_remote) return std::optional(out);
  frame.is_fd = length > 8;
  if (!bytes.empty()) {
    if (const auto wrong = take_bytes(bytes, length, frame); !wrong.empty()) return bad(line, wrong);
  } else {
    const auto data = from_base64(base64_text);
    if (!data || data->size() != length) return bad(line, "data that are not the Base64 of as many bytes as it says");
    std::ranges::copy(*data, frame.data.begin());
    frame.length = static_cast<std::uint8_t>(length);
  }
  return std::optional(out);
}

/// Reads a row: 11:49:12:9420 Rx 1 0x023 s 1 40. The last part of the time has the unit 0.1 ms.
Result<std::optional<CanLogEntry>> CanLogTable::take_busmaster(std::string_view line) {
  if (!is_can_) return bad(line, "a row of another protocol than CAN");
  const auto words = line_words(line);
  CanLogEntry out;
  CanFrame& frame = out.frame;
  const auto parts = line_words(words[0], ":");
  std::array<unsigned, 4> clock{};
  bool is_time = parts.size() == clock.size();
  for (std::size_t i = 0; is_time && i < clock.size(); ++i)
    is_time = read_number(parts[i], clock[i]) && clock[i] < 10'000;
  if (!is_time) return bad(line, "no time");
  const nanoseconds time = std::chrono::hours(clock[0]) + std::chrono::minutes(clock[1]) +
                           std::chrono::seconds(clock[2]) + std::chrono::microseconds(100 * clock[3]);
  if (is_relative_)
    out.time = last_ += time;
  else
    out.time = going_on(time, std::chrono::hours(24));
  if (words.size() < 6 || !read_number(words[2], frame.bus)) return bad(line, "too few columns");
  frame.is_local = words[1] == "Tx";
  const std::string type = plain_name(words[4]);
  frame.is_extended = type.starts_with('x');
  frame.is_remote = type == "sr" || type == "xr";
  if (type != "s" && type != "x" && !frame.is_remote) return bad(line, "an unknown type of frame");
  std::string_view id = words[3];
  if (is_hex_ && id.starts_with("0x")) id.remove_prefix(2);
  if (!take_digits(id, is_hex_ ? 16 : 10, frame)) return bad(line, "no id");
  if (frame.is_remote) return std::optional(out);
  unsigned length = 0;
  if (!read_number(words[5], length) || length > kCanDataMost || words.size() < 6 + length)
    return bad(line, "a frame without its data");
  for (unsigned i = 0; i < length; ++i)
    if (!read_number(words[6 + i], frame.data[i], is_hex_ ? 16 : 10)) return bad(line, "a byte that is none");
  frame.length = static_cast<std::uint8_t>(length);
  frame.is_fd = length > 8;
  return std::optional(out);
}

}  // namespace hueline::drivers
