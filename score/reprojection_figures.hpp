#pragma once

#include <array>
#include <string>
#include <vector>

#include "score/figures.hpp"
#include "sim/judge.hpp"

namespace hueline::score {

/// The reprojection errors of coloured points, in pixels of an 8000 x 4000 panorama. Thread safety: none.
class ReprojectionFigures {
 public:
  explicit ReprojectionFigures(const sim::RigTruth& rig);
  /// Adds a point. `direction_head` is the direction of the true point in the head's frame.
  void add(double error_px, double distance_m, std::uint8_t lens, sim::Vec3 direction_head);
  /// Adds the figures reprojection_* and their chart.
  void report(ScenarioScore& score) const;

 private:
  static constexpr std::array<double, 6> kDistances_m{2, 5, 10, 20, 40, 1e9};
  std::vector<sim::Vec3> axes_;  // optical axes of the lenses, in the head's frame
  sim::Spread all_, seam_;
  std::array<sim::Spread, kDistances_m.size()> by_distance_;
  std::vector<sim::Spread> by_lens_;
};

}  // namespace hueline::score
