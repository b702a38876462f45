#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: ouster`.
extern const DeviceType kOuster;

}  // namespace hueline::drivers
