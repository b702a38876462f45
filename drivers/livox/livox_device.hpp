#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// The device type with `driver: livox`.
extern const DeviceType kLivox;

}  // namespace hueline::drivers
