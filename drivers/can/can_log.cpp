#include "drivers/can/can_log.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "core/calendar.hpp"
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

using Entry = Result<std::optional<CanLogEntry>>;

bool take_id(std::string_view word, int base, CanFrame& frame) {
  if (word.ends_with('x')) {
    frame.is_extended = true;
    word.remove_suffix(1);
  }
  return take_digits(word, base, frame);
}

/// Reads an id. Error frames have the kernel's flag in an id of eight digits.
bool take_candump_id(std::string_view word, CanFrame& frame) {
  std::uint32_t id = 0;
  if ((word.size() != 3 && word.size() != 8) || !read_number(word, id, 16) || (word.size() == 3 && id > 0x7FF))
    return false;
  frame.is_error = word.size() == 8 && (id & 0x20000000) != 0;
  frame.is_extended = word.size() == 8 && !frame.is_error;
  frame.id = id & 0x1FFFFFFF;
  return true;
}

/// Reads a line for people: (1436509052.249713)  vcan0  RX - -  044   [5]  2A 36 6C 2B BA. A length of two digits,
/// [05], means CAN FD. The three columns before the id come with candump's option -x.
Entry take_candump_columns(std::string_view line, std::span<const std::string_view> words, CanLogEntry out) {
  std::size_t at = 0;
  if (words.size() > 3 && (words[0] == "RX" || words[0] == "TX")) {
    out.frame.is_local = words[0] == "TX";
    at = 3;
  }
  CanFrame& frame = out.frame;
  if (words.size() < at + 2 || !take_candump_id(words[at], frame)) return bad(line, "no id");
  std::string_view length = words[at + 1];
  unsigned count = 0;
  if (!length.starts_with('[') || !length.ends_with(']') || !read_number(length.substr(1, length.size() - 2), count))
    return bad(line, "no [length]");
  frame.is_fd = length.size() == 4;
  const auto data = words.subspan(at + 2);
  if (!data.empty() && data[0] == "remote") {
    frame.is_remote = true;
    return Entry(out);
  }
  if (count > (frame.is_fd ? kCanDataMost : 8)) return bad(line, "a frame without its data");
  if (const auto wrong = take_bytes(data, count, frame); !wrong.empty()) return bad(line, wrong);
  return Entry(out);
}

/// Reads the time in front of a line of candump and takes it off: (1436509052.249713) or (2020-04-22 10:21:45.123456).
bool take_candump_time(std::string_view& line, nanoseconds& out) {
  const std::size_t end = line.find(')');
  if (end == std::string_view::npos) return false;
  std::string_view text = line.substr(1, end - 1);
  line.remove_prefix(end + 1);
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));  // some programs write it in columns
  if (seconds(text, out)) return true;
  const auto parts = line_words(text, "-: ");
  UtcTime utc;
  nanoseconds in_minute{};
  if (parts.size() != 6 || !read_number(parts[0], utc.year) || !read_number(parts[1], utc.month) ||
      !read_number(parts[2], utc.day) || !read_number(parts[3], utc.hour) || !read_number(parts[4], utc.minute) ||
      !seconds(parts[5], in_minute))
    return false;
  const auto minute = from_utc(utc);
  if (!minute || in_minute > std::chrono::seconds(60)) return false;
  out = to_unix(*minute).time_since_epoch() + in_minute;
  return true;
}

/// Reads a frame for programs: 044#2A366C2BBA, 044##1AABB (FD), 044#R (remote).
Entry take_candump_frame(std::string_view line, std::string_view text, CanLogEntry out) {
  const std::size_t hash = text.find('#');
  CanFrame& frame = out.frame;
  if (!take_candump_id(text.substr(0, hash), frame)) return bad(line, "no id");
  std::string_view data = text.substr(hash + 1);
  if (data.starts_with('R')) {
    frame.is_remote = true;
    return Entry(out);
  }
  if (data.starts_with('#')) {
    frame.is_fd = true;
    data.remove_prefix(std::min<std::size_t>(2, data.size()));  // skip the second '#' and the FD flags
  }
  if (const std::size_t raw_dlc = data.find('_'); raw_dlc != std::string_view::npos) data = data.substr(0, raw_dlc);
  if (data.size() % 2 != 0 || data.size() / 2 > (frame.is_fd ? kCanDataMost : 8))
    return bad(line, "too many or half bytes");
  for (; !data.empty(); data.remove_prefix(2))
    if (!read_number(data.substr(0, 2), frame.data[frame.length++], 16)) return bad(line, "a byte that is none");
  return Entry(out);
}

/// Returns whether a line is one of candump without a time: vcan0  044   [5]  2A 36 6C 2B BA. With option -x three
/// columns stand before the id: vcan0  RX - -  044   [5]  2A 36 6C 2B BA.
bool is_candump_without_time(std::string_view line) {
  const auto words = line_words(line);
  const std::size_t id = words.size() > 1 && (words[1] == "RX" || words[1] == "TX") ? 4 : 1;
  CanFrame frame;
  return words.size() > id + 1 && words[id + 1].starts_with('[') && words[id + 1].ends_with(']') &&
         take_candump_id(words[id], frame);
}

/// Returns the columns of a version of TRC below 2.1, whose files do not name them.
std::string_view trc_columns(std::string_view version) {
  if (version == "1.1") return "NOTILD";
  if (version == "1.2") return "NOBTILD";
  if (version == "1.3") return "NOBTIRLD";
  return version.starts_with("2") ? "NOTIdlD" : "NOILD";
}

/// Returns the number of bytes that a length code means.
std::size_t bytes_of_code(std::size_t code, bool is_fd) {
  constexpr std::array<std::uint8_t, 16> kFdBytes = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
  return is_fd ? kFdBytes[code] : std::min<std::size_t>(code, 8);
}

/// Sets what the type of a row says about its frame: Rx and Tx (version 1) or DT, FD, FB, FE, BI and RR (version 2).
/// Returns false if the row has no frame: a warning, a status, error counters, an event.
bool take_trc_type(std::string_view type, CanFrame& frame) {
  frame.is_fd = type == "FD" || type == "FB" || type == "FE" || type == "BI";
  frame.is_remote = type == "RR";
  frame.is_local |= type == "Tx";
  return frame.is_fd || frame.is_remote || type == "DT" || type == "Rx" || type == "Tx";
}

}  // namespace

bool is_candump(std::string_view first_bytes) {
  for (std::string_view rest = first_bytes; !rest.empty();) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || line[begin] == '#') continue;
    line.remove_prefix(begin);
    return line[0] == '(' ? line.find_first_of("#[") != std::string_view::npos : is_candump_without_time(line);
  }
  return false;
}

Entry CanLogParser::take(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return Entry(std::nullopt);
  line.remove_prefix(begin);
  if (line[0] == '(') return take_candump(line);
  if (table_.take_head(line)) return Entry(std::nullopt);
  if (table_.is_begun()) return table_.take(line);
  if (line[0] == ';') {
    while (line.ends_with('\r') || line.ends_with(' ')) line.remove_suffix(1);
    if (constexpr std::string_view kVersion = ";$FILEVERSION="; line.starts_with(kVersion))
      columns_ = trc_columns(line.substr(kVersion.size()));
    if (constexpr std::string_view kColumns = ";$COLUMNS="; line.starts_with(kColumns)) {
      columns_ = line.substr(kColumns.size());
      std::erase(columns_, ',');
    }
    return Entry(std::nullopt);
  }
  // PEAK-Converter writes a trace as a text whose head ends with the names of the columns.
  if (line.starts_with("Number") && line.find("ID (hex)") != std::string_view::npos) {
    columns_ = "NOBdTIRlD";
    return Entry(std::nullopt);
  }
  // Version 1.0 does not say what it is; its rows begin with their number and a bracket.
  const std::size_t number = line.find_first_not_of("0123456789");
  const bool is_row = number != std::string_view::npos && number > 0;
  if (is_row && (line[number] == ')' || !columns_.empty())) return take_trc(line);
  if (!columns_.empty()) return Entry(std::nullopt);
  if (is_candump_without_time(line)) return bad(line, "a frame without a time (candump -L writes it)");
  return take_asc(line);
}

/// Reads a line: (1436509052.249713) vcan0 044#2A366C2BBA, with R or T behind it if candump was called with -x, or the
/// form for people.
Entry CanLogParser::take_candump(std::string_view line) {
  CanLogEntry out;
  std::string_view rest = line;
  if (!take_candump_time(rest, out.time)) return bad(line, "no time and frame");
  const auto words = line_words(rest);
  if (words.size() < 2) return bad(line, "no time and frame");
  out.interface = words[0];
  const bool is_for_people = words[1].find('#') == std::string_view::npos;
  // Times that begin at 0 and go back again and again are differences; those of two interfaces go back now and then.
  if (candump_lines_++ == 0) begins_at_0_ = is_for_people && out.time == nanoseconds(0);
  if (out.time < last_) ++steps_back_;
  last_ = out.time;
  if (begins_at_0_ && steps_back_ > 2 && steps_back_ * 5 > candump_lines_)
    return bad(line, "a difference where a time should be (candump -t d; use candump -L)");
  if (!is_for_people && words.size() > 2) {
    if (words.size() > 3 || (words[2] != "R" && words[2] != "T")) return bad(line, "words behind the frame");
    out.frame.is_local = words[2] == "T";
  }
  return is_for_people ? take_candump_columns(line, std::span(words).subspan(1), std::move(out))
                       : take_candump_frame(line, words[1], std::move(out));
}

Entry CanLogParser::take_trc(std::string_view line) const {
  const auto words = line_words(line);
  CanLogEntry out;
  CanFrame& frame = out.frame;
  std::size_t at = 0, length = 0;
  const std::string_view columns = columns_.empty() ? trc_columns("1.0") : std::string_view(columns_);
  const bool has_types = columns.find('T') != std::string_view::npos;
  for (const char column : columns) {
    if (column == 'D') break;
    if (at == words.size()) return bad(line, "too few columns");
    const std::string_view word = words[at++];
    switch (column) {
      case 'O':
        if (!decimal(word, 6, out.time) && !decimal(std::string(word) + ".0", 6, out.time))
          return bad(line, "no time in milliseconds");
        break;
      case 'T':
        if (word == "ER" || word == "Error") {
          frame = broken_frame(frame.bus);
          return Entry(out);
        }
        if (!take_trc_type(word, frame)) return Entry(std::nullopt);
        break;
      case 'B':
        if (word != "-" && !read_number(word, frame.bus)) return bad(line, "no number of the bus");
        break;
      case 'I':
        if (!has_types && word == "FFFFFFFF") return Entry(std::nullopt);  // a warning of version 1.0
        frame.is_extended = word.size() > 4;
        if (!take_digits(word, 16, frame)) return bad(line, "no id");
        break;
      case 'd':
        frame.is_local = word == "Tx";
        break;
      case 'L':
        if (!read_number(word, length) || length > 15) return bad(line, "no length code");
        length = bytes_of_code(length, frame.is_fd);
        break;
      case 'l':
        if (!read_number(word, length) || length > (frame.is_fd ? kCanDataMost : 8)) return bad(line, "no length");
        break;
      default:
        break;  // the row's number, or what is not used
    }
  }
  frame.is_remote |= at < words.size() && words[at] == "RTR";
  if (frame.is_remote) return Entry(out);
  if (const auto wrong = take_bytes(std::span(words).subspan(at), length, frame); !wrong.empty())
    return bad(line, wrong);
  return Entry(out);
}

Entry CanLogParser::take_asc(std::string_view line) {
  const auto words = line_words(line);
  if (words[0] == "base") {
    for (std::size_t i = 1; i < words.size(); ++i) {
      if (words[i] == "dec") is_hex_ = false;
      if (words[i] == "relative") is_relative_ = true;
    }
    return Entry(std::nullopt);
  }
  CanLogEntry out;
  // A line without a frame: "date", "//", "Begin Triggerblock", ...
  if (!seconds(words[0], out.time)) return Entry(std::nullopt);
  if (is_relative_) out.time += last_;
  last_ = out.time;
  CanFrame& frame = out.frame;
  const int base = is_hex_ ? 16 : 10;
  const bool is_fd = words.size() > 1 && words[1] == "CANFD";
  const std::size_t channel = is_fd ? 2 : 1;
  if (words.size() < channel + 2 || !read_number(words[channel], frame.bus))
    return Entry(std::nullopt);  // another event: "Start of measurement", statistics
  for (std::size_t i = channel + 1; i < std::min(words.size(), channel + 3); ++i)
    if (words[i] == "ErrorFrame") {
      frame = broken_frame(frame.bus);
      return Entry(out);
    }
  if (is_fd) {
    // Form: time CANFD channel Rx|Tx id [name] brs esi dlc length data...
    std::size_t at = channel + 1;
    if (words.size() < at + 6 || !take_id(words[at + 1], base, frame)) return bad(line, "no FD frame");
    at += 2;
    if (words[at] != "0" && words[at] != "1") ++at;
    unsigned length = 0;
    if (words.size() < at + 4 || !read_number(words[at + 3], length) || length > kCanDataMost ||
        words.size() < at + 4 + length)
      return bad(line, "an FD frame without its data");
    frame.is_fd = true;
    for (unsigned i = 0; i < length; ++i)
      if (!read_number(words[at + 4 + i], frame.data[i], base)) return bad(line, "a byte that is none");
    frame.length = static_cast<std::uint8_t>(length);
    return Entry(out);
  }
  // Form: time channel id Rx|Tx d|r length data...
  if (words.size() < 5 || (words[3] != "Rx" && words[3] != "Tx" && words[3] != "TxRq")) return Entry(std::nullopt);
  if (!take_id(words[2], base, frame)) return bad(line, "no id");
  frame.is_local = words[3] != "Rx";
  if (words[4] == "r") {
    frame.is_remote = true;
    return Entry(out);
  }
  unsigned length = 0;
  if (words[4] != "d" || words.size() < 6 || !read_number(words[5], length, 16))
    return bad(line, "a frame without its data");
  // The length code of a classic frame may be 9 to 15, which means 8 bytes. Some programs write FD frames in this form.
  frame.is_fd = length > 8 && length <= kCanDataMost && words.size() >= 6 + length && words[6 + 8].size() <= 3 &&
                words[6 + 8].find_first_not_of("0123456789ABCDEFabcdef") == std::string_view::npos;
  if (!frame.is_fd && length > 8 && length <= 15) length = 8;
  if (length > (frame.is_fd ? kCanDataMost : 8) || words.size() < 6 + length)
    return bad(line, "a frame without its data");
  for (unsigned i = 0; i < length; ++i)
    if (!read_number(words[6 + i], frame.data[i], base)) return bad(line, "a byte that is none");
  frame.length = static_cast<std::uint8_t>(length);
  return Entry(out);
}

}  // namespace hueline::drivers
