#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The word `velodyne` of a rig.
extern const DeviceType kVelodyne;

}  // namespace hueline::drivers
