#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: robosense`.
extern const DeviceType kRobosense;

}  // namespace hueline::drivers
