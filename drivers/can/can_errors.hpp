#pragma once

#include <string>
#include <vector>

#include "core/fault.hpp"
#include "drivers/can/can_frame.hpp"

namespace hueline::drivers {

/// One thing that an error frame says.
struct CanTrouble {
  FaultKind kind = FaultKind::Malformed;
  std::string detail;
};

/// What a controller says of its bus by an error frame (linux/can/error.h), in words. Disconnected: it is off the bus
/// (bus-off); Reconnected: it was restarted; Lost: its buffer was full; Malformed: frames break on the bus. Nothing: no
/// trouble of a listener (recovered, lost an arbitration).
std::vector<CanTrouble> explain_can_error(const CanFrame& frame);

}  // namespace hueline::drivers
