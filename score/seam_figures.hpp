#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "score/ciede2000.hpp"
#include "score/figures.hpp"
#include "sim/vec3.hpp"

namespace hueline::score {

/// The steps of colour where one surface is coloured from two exposures by one lens (an exposure seam) or by two lenses
/// of one exposure (a lens seam). Surfaces are divided into cubes of 0.25 m. In each cube that both sides colour, the
/// two mean colour errors are subtracted, so that true differences such as texture cancel. The step of a seam is the
/// median over its cubes of the differences in L*, a* and b*, expressed as CIEDE2000 around the seam's true mean. The
/// median removes pixel noise and a few wrong surfaces and keeps what an eye sees along the seam. Thread safety: none.
class SeamFigures {
 public:
  static constexpr double kCell_m = 0.25;
  /// Smallest number of points that a side of a cube needs to be used.
  static constexpr std::uint32_t kEnough = 5;
  static constexpr std::size_t kEnoughCubes = 12;  ///< smallest number of cubes that a seam needs to be used

  /// Adds a point; `place` is its true place in the scene's local level.
  void add(sim::Vec3 place, std::uint16_t surface, std::uint32_t exposure, std::uint8_t lens, Lab claimed, Lab truth);
  /// Adds the figures exposure_seam_de00 and lens_seam_de00 (medians over the seams) and their chart.
  void report(ScenarioScore& score) const;

 private:
  struct Side {
    std::uint32_t exposure = 0, count = 0;
    std::uint8_t lens = 0;
    std::array<float, 3> error{}, truth{};  // sums
  };
  std::unordered_map<std::uint64_t, std::vector<Side>> cells_;
};

}  // namespace hueline::score
