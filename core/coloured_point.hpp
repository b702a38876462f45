#pragma once

#include <cstdint>
#include <vector>

#include "core/fault.hpp"
#include "core/geodesy.hpp"
#include "core/time.hpp"

namespace hueline {

/// Whether and how a point got its colour.
enum class ColourState : std::uint8_t {
  Direct = 0,      ///< from the exposure that owns its time
  Neighbour = 1,   ///< owner saw the nadir hole or the vehicle there: filled from a neighbouring exposure
  NoExposure = 2,  ///< uncoloured: no usable exposure owns its time (lost image)
  Outside = 3,     ///< uncoloured: no usable exposure near enough sees that direction
  NoPose = 4,      ///< reserved for points that cannot be placed; such points are counted, not written
};
constexpr int kColourStates = 5;
const char* name(ColourState state);

constexpr std::uint32_t kNoExposure = 0xFFFFFFFFu;
constexpr std::uint8_t kNoLens = 0xFF;

/// A georeferenced, coloured return. Position in Enu at the cloud's origin (double, m). Each member has its entry in
/// core/point_fields.hpp.
struct ColouredPoint {
  double east = 0, north = 0, up = 0;
  GpsTime time{};                        ///< firing
  std::uint32_t exposure = kNoExposure;  ///< index of the exposure that gave the colour
  float u = 0, v = 0;  ///< pixel that gave it: of the lens image, or of the panorama in the sphere method (then lens
                       ///< still names the lens that was sampled). Pixel centres at whole numbers.
  std::uint8_t red = 0, green = 0, blue = 0;
  ColourState state = ColourState::NoExposure;
  std::uint8_t lens = kNoLens;
  std::uint8_t quality = 0;  ///< 0 uncoloured ... 255 best: pixel distance to the border, time distance, clock state
  std::uint8_t reflectivity = 0;
  std::uint8_t return_number = 1, return_count = 1;
  std::uint16_t channel = 0;
  SensorId sensor{};
  float sigma_m = 0;  ///< one-sigma position uncertainty from pose, time and range
  bool operator==(const ColouredPoint&) const = default;
};

/// Points in the order of their firing batches; all blocks of a drive share `origin`.
struct CloudBlock {
  Geodetic origin{};
  std::vector<ColouredPoint> points;
};

}  // namespace hueline
