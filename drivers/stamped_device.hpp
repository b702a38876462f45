#pragma once

#include "drivers/device.hpp"

namespace hueline::drivers {

/// A laser scanner whose times were stamped by somebody else: a program that received its data.
class StampedDevice : public Device {
 public:
  /// Returns one sigma of the stamps on the clock that made them.
  virtual nanoseconds stamp_sigma() const = 0;
};

}  // namespace hueline::drivers
