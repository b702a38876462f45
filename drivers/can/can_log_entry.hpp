#pragma once

#include <string>

#include "drivers/can/can_frame.hpp"

namespace hueline::drivers {

/// A frame of a log with its time on the log's own clock: since 1970 (candump, python-can), since the beginning of the
/// log or of its day (ASC, TRC, BUSMASTER), or of its adapter (SavvyCAN).
struct CanLogEntry {
  nanoseconds time{0};
  CanFrame frame;
  /// The interface that a line of candump names; empty in the other logs, which have numbers.
  std::string interface;
};

}  // namespace hueline::drivers
