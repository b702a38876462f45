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

/// A panoramic photograph, infinitely far away, in place of the painted sky. Cameras see it; lasers do not reach it; it
/// does not light the scene. Immutable; thread-safe.
class Surroundings {
 public:
  /// Reads a JPEG of an equirectangular panorama, which is twice as wide as high and has the zenith on top.
  /// `centre_azimuth_deg` is the azimuth of its middle column, clockwise from north. Errors: Io; Malformed (no JPEG, or
  /// another shape).
  static Result<std::shared_ptr<const Surroundings>> load(const std::filesystem::path& file, double centre_azimuth_deg);

  /// Returns the light from a direction (unit length; x east, y north, z up), averaged over a cone of `cone` rad. 1 is
  /// the photograph's white.
  Radiance at(Vec3 direction, float cone) const;
  /// Returns "<hash of the file's bytes>@<azimuth>". It is a part of the scenario's text, because it decides the
  /// drive's bytes.
  const std::string& identity() const { return identity_; }

 private:
  struct Level {
    std::size_t width = 0, height = 0;
    std::vector<std::uint8_t> rgb;  // sRGB
  };
  Surroundings() = default;
  static Level halved(const Level& level);

  std::vector<Level> levels_;  // each level is half as wide as the one before
  double centre_azimuth_ = 0;  // rad
  std::string identity_;
};

}  // namespace hueline::sim
