#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: ublox`.
extern const DeviceType kUblox;

}  // namespace hueline::drivers
