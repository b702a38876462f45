#pragma once

#include <span>

#include "fusion/single_shot.hpp"

namespace hueline::fusion {

/// How many points beside outlines have the colour of what is nearer.
struct OutlineShare {
  std::size_t judged = 0;   ///< points behind an outline whose two sides differ in colour
  std::size_t foreign = 0;  ///< those of them that have the colour of the nearer side

  double share() const { return judged == 0 ? 0.0 : static_cast<double>(foreign) / static_cast<double>(judged); }
};

/// The figures of a single shot, without truth.
struct OutlineFigures {
  OutlineShare all;      ///< every point in the image
  OutlineShare kept;     ///< those that the test of visibility keeps
  OutlineShare refused;  ///< those that it refuses
};

/// Judges the colours beside outlines. A point is beside an outline if something nearer lies within `reach_px` of it in
/// the image. Two colours are expected there: that of the nearer thing, from its points that have nothing before them,
/// and that of the point's own surface, from its points away from outlines. Where the two differ by more than 20 in
/// CIELAB, the point has the one or the other.
///
/// `points` are coloured without a test of visibility; `tested` are the same points, coloured with it. Both are in the
/// order of `places`. Pure.
OutlineFigures judge_outlines(std::span<const Point<Scanner>> places, std::span<const ShotPoint> points,
                              std::span<const ShotPoint> tested, double reach_px);

/// Returns how far apart neighbouring rings of the scanner lie in the image, px: the median distance of a point to the
/// next one along rows or columns, whichever is larger. Zero without points.
double ring_gap_px(std::span<const ShotPoint> points);

}  // namespace hueline::fusion
