#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: sbet`.
extern const DeviceType kSbet;

}  // namespace hueline::drivers
