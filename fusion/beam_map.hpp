#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fusion/direction_grid.hpp"

/// What the beams of a scanner say about places that other beams met at other times.
namespace hueline::fusion {

/// What the beams of one short time say about a place.
enum class Presence : std::uint8_t {
  Unknown,   ///< no beam came near
  Free,      ///< beams went past the place to something farther, so nothing was there
  Occupied,  ///< a beam met something at the place's own distance
};

/// How far the beams of one scanner went during one turn, as seen from where the scanner was in the middle of it.
/// Thread safety: one thread adds and finishes; ask() may then be called by many.
class BeamMap {
 public:
  explicit BeamMap(const DirectionGrid& grid);
  /// Adds a point that locate() found.
  void add(std::uint32_t cell, float nearness) {
    if (nearness > nearest_[cell]) nearest_[cell] = nearness;
  }
  /// Ends the turn. ask() may be called from then on.
  void finish();
  /// Returns what the beams say about a place that locate() found.
  Presence ask(std::uint32_t cell, float nearness) const {
    // Ground that is seen at a grazing angle spans much distance within a cell.
    constexpr float kFree_m = 0.25f, kGrazing = 0.002f;  // 1/m
    const Span& span = spans_[cell];
    if (span.near == 0.0f || !(nearness > 0.0f)) return Presence::Unknown;
    const float distance = 1.0f / nearness, slack = kFree_m + kGrazing * distance * distance;
    if ((distance + slack) * span.near < 1.0f) return Presence::Free;
    return (distance - slack) * span.far < 1.0f ? Presence::Occupied : Presence::Unknown;
  }

 private:
  /// The nearest and the farthest point in a cell and its neighbours, 1/m; `near` is 0 if there is none.
  struct Span {
    float near, far;
  };
  DirectionGrid grid_;
  std::vector<float> nearest_;
  std::vector<Span> spans_;
};

}  // namespace hueline::fusion
