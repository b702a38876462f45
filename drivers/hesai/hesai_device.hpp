#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: hesai`.
extern const DeviceType kHesai;

}  // namespace hueline::drivers
