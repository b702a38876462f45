#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: profile_scanner`.
extern const DeviceType kProfileScanner;

}  // namespace hueline::drivers
