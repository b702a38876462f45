#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "score/ciede2000.hpp"
#include "score/figures.hpp"
#include "sim/vec3.hpp"

namespace hueline::score {

/// The flicker of a surface: the colour difference between two neighbouring points of which different exposures or
/// lenses gave the colour. Two points are neighbours if they lie in one cube of 0.1 m of one surface that stands still.
/// The difference of their true colours is subtracted, and what is left counts if it is positive; texture and shadows
/// therefore do not count. In contrast to the steps of SeamFigures, each pair counts by itself, so that noise and wrong
/// surfaces show. Thread safety: none.
class FlickerFigures {
 public:
  static constexpr double kCell_m = 0.1;
  /// One cube in so many is examined, chosen by a hash of its place and surface.
  static constexpr std::uint64_t kOneIn = 8;

  /// Adds a point; `place` is its true place in the scene's local level. `order` decides which of several points of one
  /// source in a cube is used (the smallest) and must be unique.
  void add(sim::Vec3 place, std::uint16_t surface, std::uint64_t order, std::uint32_t exposure, std::uint8_t lens,
           Lab claimed, Lab truth);
  /// Adds the figure flicker_de00_p90 and its chart.
  void report(ScenarioScore& score) const;

 private:
  struct Side {
    std::uint64_t order = 0;
    std::uint32_t exposure = 0;
    std::uint8_t lens = 0;
    std::array<float, 3> claimed{}, truth{};
  };
  std::unordered_map<std::uint64_t, std::vector<Side>> cells_;  // sides by exposure and lens
};

}  // namespace hueline::score
