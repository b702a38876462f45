#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: nmea`.
extern const DeviceType kNmea;

}  // namespace hueline::drivers
