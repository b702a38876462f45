#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: wheel`.
extern const DeviceType kWheel;

}  // namespace hueline::drivers
