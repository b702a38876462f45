#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: applanix`.
extern const DeviceType kApplanix;

}  // namespace hueline::drivers
