#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: oxts`.
extern const DeviceType kOxts;

}  // namespace hueline::drivers
