#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "drivers/can/can_log_entry.hpp"
#include "drivers/can/can_log_table.hpp"

namespace hueline::drivers {

/// Returns whether a file that begins with `first_bytes` is a log of candump: with times in front of its frames, which
/// CanLogParser reads, or without, which it refuses. Empty lines and comments (#) may come first.
bool is_candump(std::string_view first_bytes);

/// Reads text logs of CAN buses line by line: Vector's ASC (classic, FD and error frames; ids and data in the number
/// base that the file names), traces of PEAK's programs (TRC, versions 1.0 to 2.1, and the CSV of PEAK-Converter with
/// blanks between its columns), what candump writes with -L, or with its times since 1970 (-t a), by date (-t A, taken
/// for UTC) or since its beginning (-t z), and what CanLogTable reads. What it knows about ASC and TRC comes from their
/// published descriptions and from logs. Thread safety: none; one thread reads one log.
class CanLogParser {
 public:
  /// Reads the next line. Returns a frame, or nothing if the line has none (header, comment, another event). Error:
  /// Malformed.
  Result<std::optional<CanLogEntry>> take(std::string_view line);

 private:
  Result<std::optional<CanLogEntry>> take_asc(std::string_view line);
  Result<std::optional<CanLogEntry>> take_trc(std::string_view line) const;
  Result<std::optional<CanLogEntry>> take_candump(std::string_view line);
  /// The letters of a trace's columns, as version 2 names them; empty: it is none, or of version 1.0.
  std::string columns_;
  bool is_hex_ = true, is_relative_ = false;
  nanoseconds last_{0};                               ///< time of the latest frame
  std::uint64_t candump_lines_ = 0, steps_back_ = 0;  ///< and how many of them are earlier than the one before
  bool begins_at_0_ = false;
  CanLogTable table_;
};

}  // namespace hueline::drivers
