#pragma once

#include <array>
#include <string>
#include <vector>

#include "score/figures.hpp"
#include "sim/judge.hpp"

namespace hueline::score {

/// Reprojection errors of coloured points, in pixels of an 8000 x 4000 panorama. Thread-bound.
class ReprojectionFigures {
 public:
  explicit ReprojectionFigures(const sim::RigTruth& rig);
  /// `direction_head`: of the true point.
  void add(double error_px, double distance_m, std::uint8_t lens, sim::Vec3 direction_head);
  /// reprojection_* and their chart.
  void report(ScenarioScore& score) const;

 private:
  static constexpr std::array<double, 6> kDistances_m{2, 5, 10, 20, 40, 1e9};
  std::vector<sim::Vec3> axes_;  // of the lenses, in the head's frame
  sim::Spread all_, seam_;
  std::array<sim::Spread, kDistances_m.size()> by_distance_;
  std::vector<sim::Spread> by_lens_;
};

}  // namespace hueline::score
