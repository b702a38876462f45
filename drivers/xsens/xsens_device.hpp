#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: xsens`.
extern const DeviceType kXsens;

}  // namespace hueline::drivers
