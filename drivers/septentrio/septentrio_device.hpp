#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: septentrio`.
extern const DeviceType kSeptentrio;

}  // namespace hueline::drivers
