#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "sim/radiance.hpp"
#include "sim/vec3.hpp"

namespace hueline::sim {

/// A photograph all around, infinitely far away, instead of the painted sky: what no laser reaches and every camera
/// sees. It does not light the scene. Immutable; thread-safe.
class Surroundings {
 public:
  /// A JPEG of an equirectangular panorama: twice as wide as high, zenith on top. `centre_azimuth_deg`: of its middle
  /// column, clockwise from north. Errors: Io; Malformed: no JPEG, or another shape.
  static Result<std::shared_ptr<const Surroundings>> load(const std::filesystem::path& file, double centre_azimuth_deg);

  /// Light from a direction (unit length; x east, z up), averaged over a cone, rad. 1 is the photograph's white.
  Radiance at(Vec3 direction, float cone) const;
  /// "<hash of the file's bytes>@<azimuth>": decides the drive's bytes, so it is part of the scenario's text.
  const std::string& identity() const { return identity_; }

 private:
  struct Level {
    std::size_t width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // sRGB
  };
  Surroundings() = default;
  static Level halved(const Level& level);

  std::vector<Level> levels_;  // each half as wide as the one before
  double centre_azimuth_ = 0;  // rad
  std::string identity_;
};

}  // namespace hueline::sim
