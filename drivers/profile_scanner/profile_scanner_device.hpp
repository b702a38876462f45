#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The word `profile_scanner` of a rig.
extern const DeviceType kProfileScanner;

}  // namespace hueline::drivers
