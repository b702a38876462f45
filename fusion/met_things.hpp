#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/time.hpp"
#include "fusion/direction_grid.hpp"

namespace hueline::fusion {

/// The points that beams met on moving things shortly before and after a moment, as its head sees their places. What
/// was at a place both before and after the moment was there at the moment too.
///
/// Thread safety: one thread adds and sorts; was_met() may then be called by many.
class MetThings {
 public:
  /// A point lies at a place if it is no farther than this from it in each direction of the grid, cells.
  static constexpr int kBeside = 3;

  /// Adds a point that locate() found, from before or after the moment.
  void add(bool is_after, std::uint32_t cell, float nearness) { points_[is_after].emplace_back(cell, nearness); }
  /// To be called before was_met(), after the last add().
  void sort();
  /// Whether a point of after the moment (or before) lies at the place that locate() found: in a cell beside it, and as
  /// far within `tolerance_m` and `tolerance_share` of the distance.
  bool was_met(const DirectionGrid& grid, bool is_after, std::uint32_t cell, float nearness, float tolerance_m,
               float tolerance_share) const;

 private:
  std::array<std::vector<std::pair<std::uint32_t, float>>, 2> points_;  // before, after: cell and nearness, in order
};

}  // namespace hueline::fusion
