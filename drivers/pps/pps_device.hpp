#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The word `pps` of a rig.
extern const DeviceType kPps;

}  // namespace hueline::drivers
