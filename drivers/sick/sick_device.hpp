#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: sick`.
extern const DeviceType kSick;

}  // namespace hueline::drivers
