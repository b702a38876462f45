#pragma once

#include <array>
#include <numbers>

/// Sines and cosines of the azimuths that scanners of several makers send, in 0.01 degrees.
namespace hueline::drivers {

constexpr int kAzimuthsOfCircle = 36000;                                                      ///< in 0.01 degrees
constexpr float kAzimuthStep = static_cast<float>(2 * std::numbers::pi / kAzimuthsOfCircle);  ///< rad

struct AzimuthDirection {
  float sine, cosine;
};

/// Returns the directions of all azimuths, by azimuth. They are computed once for all decoders. Thread-safe.
const std::array<AzimuthDirection, kAzimuthsOfCircle>& azimuth_directions();

}  // namespace hueline::drivers
