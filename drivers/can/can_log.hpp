#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "drivers/can/can_frame.hpp"

namespace hueline::drivers {

/// A frame of a log with its time on the log's own clock: since the beginning of the log (ASC, TRC), or since 1970
/// (candump).
struct CanLogEntry {
  nanoseconds time{0};
  CanFrame frame;
  std::string interface {
  };  ///< the interface that a line of candump names; empty in the other logs, which have numbers
};

/// Reads text logs of CAN buses line by line: Vector's ASC (classic, FD and error frames; ids and data in the number
/// base that the file names), traces of PEAK's programs (TRC, versions 1.0 to 2.1), and what `candump -L` or
/// `candump -t a` writes. What it knows about ASC and TRC comes from their published descriptions and from logs.
/// Thread safety: none; one thread reads one log.
class CanLogParser {
 public:
  /// Reads the next line. Returns a frame, or nothing if the line has none (header, comment, another event). Error:
  /// Malformed.
  Result<std::optional<CanLogEntry>> take(std::string_view line);

 private:
  Result<std::optional<CanLogEntry>> take_asc(std::string_view line);
  Result<std::optional<CanLogEntry>> take_trc(std::string_view line) const;
  /// The letters of a trace's columns, as version 2 names them; empty: it is none, or of version 1.0.
  std::string columns_;
  bool is_hex_ = true, is_relative_ = false;
  nanoseconds last_{0};
};

}  // namespace hueline::drivers
