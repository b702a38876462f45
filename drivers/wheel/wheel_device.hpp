#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The word `wheel` of a rig.
extern const DeviceType kWheel;

}  // namespace hueline::drivers
