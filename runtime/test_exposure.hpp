#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "config/rig.hpp"
#include "core/measurements.hpp"
#include "runtime/readiness.hpp"

namespace hueline::runtime {

/// How bright the pixels of one lens are in a test exposure, as the sensor gave them, 0 to 255: of all colours
/// together, before any gain.
struct LensLight {
  static constexpr std::size_t kBins = 64;
  std::string camera, lens;                   ///< their names in the rig
  std::array<std::uint64_t, kBins> pixels{};  ///< number of pixels by value, four values a bin

  std::uint64_t count() const;
  /// Returns the least value, as the end of a bin, that half of the pixels do not exceed.
  int median() const;
  double dark_share() const;       ///< share of pixels below 8: no light, or hardly any
  double saturated_share() const;  ///< share of pixels of 252 or more: their colour is lost
};

/// Makes a test exposure of each camera's last whole image. Thread safety: none.
class TestExposure {
 public:
  /// `rig` must outlive the object.
  explicit TestExposure(const config::Rig& rig) : rig_(rig) {}
  /// Takes an image. Of each camera one a second is counted.
  void take(const Image& image);
  /// Returns the lenses whose cameras sent a whole image, in the order of the rig.
  std::vector<LensLight> lenses() const;

 private:
  struct Counted {
    HostTime at{};
    std::map<std::string, LensLight> lenses;
  };
  const config::Rig& rig_;
  std::map<SensorId, Counted> cameras_;
};

/// Returns what is wrong with the light in a test exposure: a lens that sees nothing, or images that are much too dark
/// or too bright.
std::vector<Finding> check_light(const std::vector<LensLight>& lenses);

}  // namespace hueline::runtime
