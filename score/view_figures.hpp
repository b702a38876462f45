#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "score/ciede2000.hpp"
#include "score/figures.hpp"
#include "sim/judge.hpp"

namespace hueline::score {

/// What an image that was left out of the colouring showed at a pixel, and what the coloured cloud predicted there.
struct HeldOutPixel {
  std::array<std::uint8_t, 3> predicted, seen;
};

/// How well the coloured cloud predicts images that gave it no colour. It needs no truth. No camera knows how bright
/// the world is, so that one factor for each lens and exposure is removed first: the median ratio of seen to predicted
/// luminance. Thread safety: none.
class HeldOutFigures {
 public:
  /// At most so many pixels of a lens at an exposure are compared; they are spread evenly over those that there are.
  static constexpr std::size_t kMostPixels = 4000;
  /// With fewer pixels the factor is not known, and the lens is left out at this exposure.
  static constexpr std::size_t kFewestPixels = 100;
  explicit HeldOutFigures(LabOfRgb::Encoding encoding) : lab_(encoding) {}

  /// Adds one lens at one exposure.
  void add(std::span<const HeldOutPixel> pixels);
  /// Adds the figures held_out_* and their chart.
  void report(ScenarioScore& score) const;

 private:
  LabOfRgb lab_;
  sim::Spread difference_;
  std::uint64_t within10_ = 0, views_ = 0, small_views_ = 0, pixels_ = 0;
};

/// What was counted of the laser's depth edges in images (survey::DepthEdges::Counts).
struct DepthEdgeFacts {
  std::uint64_t exposures = 0;                 ///< examined exposures
  std::uint64_t edges = 0, missed = 0;         ///< depth edges in an image, and those without an image edge near them
  std::uint64_t places = 0, missed_there = 0;  ///< the same of arbitrary places near the edges
};
/// Adds the figures depth_edge_* and a note. They need no truth.
void add_depth_edge_figures(const DepthEdgeFacts& facts, ScenarioScore& score);

/// Adds the figures drift_*. `told_s` has the times at which a drift of the head was reported, and `drift_s` that at
/// which it truly drifted, if it did; both in s since the beginning of the drive.
void add_drift_figures(const std::vector<double>& told_s, std::optional<double> drift_s, ScenarioScore& score);
/// Adds the same figures without values: nothing was watched.
void add_unwatched_drift_figures(ScenarioScore& score);

}  // namespace hueline::score
