#pragma once

#include <string>
#include <vector>

#include "core/fault.hpp"
#include "drivers/can/can_frame.hpp"

namespace hueline::drivers {

/// One problem that an error frame reports.
struct CanTrouble {
  FaultKind kind = FaultKind::Malformed;
  std::string detail;
};

/// Returns what a controller reports about its bus by an error frame (linux/can/error.h), in words. Disconnected: the
/// controller is off the bus (bus-off). Reconnected: it was restarted. Lost: its buffer was full. Malformed: frames
/// break on the bus. The list is empty if the report is no problem for a listener (the bus recovered, or an arbitration
/// was lost).
std::vector<CanTrouble> explain_can_error(const CanFrame& frame);
/// Returns the error frame that stands for an entry of a log which says no more than that a frame broke on the bus.
CanFrame broken_frame(std::uint8_t bus);

}  // namespace hueline::drivers
