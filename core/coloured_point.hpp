#pragma once

#include <cstdint>
#include <vector>

#include "core/fault.hpp"
#include "core/geodesy.hpp"
#include "core/time.hpp"

namespace hueline {

/// Whether a point has a colour, and from where.
enum class ColourState : std::uint8_t {
  Direct = 0,     ///< coloured from the exposure that owns its time
  Neighbour = 1,  ///< coloured from a neighbouring exposure, because the owner sees the nadir hole or the vehicle there
  NoExposure = 2,  ///< no colour: no usable exposure owns its time (lost image)
  Outside = 3,     ///< no colour: no usable exposure that is near enough sees that direction
  NoPose = 4,      ///< reserved for points that cannot be placed; such points are counted, not written
  Hidden = 5,      ///< no colour: in every exposure that is near enough something nearer hides it
};
constexpr int kColourStates = 6;
/// Returns the enumerator's name.
const char* name(ColourState state);

constexpr std::uint32_t kNoExposure = 0xFFFFFFFFu;  ///< ColouredPoint::exposure of a point without a colour
constexpr std::uint8_t kNoLens = 0xFF;              ///< ColouredPoint::lens of a point without a colour

/// A return with its place and colour. The place is in Enu at the cloud's origin, in metres. Each member has an entry
/// in core/point_fields.hpp.
struct ColouredPoint {
  double east = 0, north = 0, up = 0;
  GpsTime time{};                        ///< the firing
  std::uint32_t exposure = kNoExposure;  ///< index of the exposure that gave the colour
  /// The pixel that gave the colour; pixel centres have whole numbers. It is a pixel of the lens image or, with the
  /// panorama method, of the panorama; `lens` then still names the lens that was sampled.
  float u = 0, v = 0;
  std::uint8_t red = 0, green = 0, blue = 0;
  ColourState state = ColourState::NoExposure;
  std::uint8_t lens = kNoLens;
  /// Quality of the colour, from 0 (no colour) to 255 (best). It depends on the pixel's distance from the border, the
  /// distance in time and the clock's state.
  std::uint8_t quality = 0;
  /// Confidence that the point lies on something that moves by itself, from 0 (no evidence) to 255 (certain).
  std::uint8_t moving = 0;
  std::uint8_t reflectivity = 0;
  std::uint8_t return_number = 1, return_count = 1;
  std::uint16_t channel = 0;
  SensorId sensor{};
  float sigma_m = 0;  ///< one sigma of the place, from pose, time and range
  bool operator==(const ColouredPoint&) const = default;
};

/// Coloured points in the order of their firing batches. All blocks of a drive have the same `origin`.
struct CloudBlock {
  Geodetic origin{};
  std::vector<ColouredPoint> points;
};

}  // namespace hueline
