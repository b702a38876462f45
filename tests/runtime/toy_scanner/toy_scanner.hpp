#pragma once

#include <span>
#include <vector>

#include "core/measurements.hpp"
#include "drivers/device.hpp"

/// A made-up scanner that shows all that is needed to add one: this folder, and one line where the kinds of devices are
/// listed.
namespace hueline::toy {

/// The device with the word `toy_scanner` in a rig.
extern const drivers::DeviceType kToyScanner;

/// "TOY" and a letter, the time in ns of GPS (8 bytes), and for each point x, y, z in m (4 bytes each). 'S' is the
/// status, which says that the scanner's clock is locked and has no points, 'D' is data.
std::vector<std::byte> encode(char kind, GpsTime time, std::span<const std::array<float, 3>> points = {});

}  // namespace hueline::toy
