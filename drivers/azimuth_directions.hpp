#pragma once

#include <array>

/// Sines and cosines of the azimuths that scanners of several makers send, in 0.01 degrees.
namespace hueline::drivers {

constexpr int kAzimuthsOfCircle = 36000;  ///< in 0.01 degrees

struct AzimuthDirection {
  float sine, cosine;
};

/// Returns the directions of all azimuths, by azimuth. They are computed once for all decoders. Thread-safe.
const std::array<AzimuthDirection, kAzimuthsOfCircle>& azimuth_directions();

}  // namespace hueline::drivers
