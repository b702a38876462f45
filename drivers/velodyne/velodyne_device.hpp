#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: velodyne`.
extern const DeviceType kVelodyne;

}  // namespace hueline::drivers
