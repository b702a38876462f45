#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: pps`.
extern const DeviceType kPps;

}  // namespace hueline::drivers
