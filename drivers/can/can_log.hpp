#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "drivers/can/can_frame.hpp"

namespace hueline::drivers {

/// A frame of a log and when it was seen, on the log's own clock: from its beginning (ASC) or from 1970 (candump).
struct CanLogEntry {
  nanoseconds time{0};
  CanFrame frame;
};

/// Text logs of CAN buses, line by line: Vector's ASC (classic, FD and error frames; ids and data by the file's base)
/// and what `candump -L` or `candump -t a` writes. Facts of ASC from its published description and from logs.
/// Reentrant.
class CanLogParser {
 public:
  /// Of the next line: a frame; nothing (head, comment, an event that is no frame); or Malformed.
  Result<std::optional<CanLogEntry>> take(std::string_view line);

 private:
  Result<std::optional<CanLogEntry>> take_asc(std::string_view line);
  bool is_hex_ = true, is_relative_ = false;
  nanoseconds last_{0};
};

}  // namespace hueline::drivers
