#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "score/ciede2000.hpp"
#include "score/figures.hpp"
#include "sim/vec3.hpp"

namespace hueline::score {

/// Steps where one surface is coloured from two exposures by one lens (an exposure seam), or by two lenses of one
/// exposure (a lens seam). Surfaces are cut into cubes of 0.25 m; in each cube that both sides colour, the difference
/// of the two mean colour errors is taken: the true difference, texture for one, is out. The step of a seam is the
/// median of its cubes' differences in L*, a* and b*, as CIEDE2000 on top of the seam's true mean: pixel noise and a
/// few wrong surfaces drop out, what an eye sees along the seam stays. Thread-bound.
class SeamFigures {
 public:
  static constexpr double kCell_m = 0.25;
  static constexpr std::uint32_t kEnough = 5;      ///< points of a side, below which a cube's side says nothing
  static constexpr std::size_t kEnoughCubes = 12;  ///< below which a seam says nothing

  /// `place`: true place of the point in the scene's local level.
  void add(sim::Vec3 place, std::uint16_t surface, std::uint32_t exposure, std::uint8_t lens, Lab claimed, Lab truth);
  /// exposure_seam_de00, lens_seam_de00: the median over seams; and their chart.
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
