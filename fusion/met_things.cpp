#include "fusion/met_things.hpp"

#include <algorithm>

namespace hueline::fusion {

void MetThings::sort() {
  for (auto& points : points_) std::sort(points.begin(), points.end());
}

bool MetThings::was_met(const DirectionGrid& grid, bool is_after, std::uint32_t cell, float nearness, float tolerance_m,
                        float tolerance_share) const {
  const auto& points = points_[is_after];
  const auto columns = static_cast<std::int64_t>(grid.columns);
  const float slack = 1.0f - tolerance_m * nearness, share = 1.0f + tolerance_share;
  for (int row = -kBeside; row <= kBeside; ++row) {
    // A neighbour beyond the grid's first column lies in the row before, which is as good: rows are dense.
    const std::int64_t middle = static_cast<std::int64_t>(cell) + row * columns;
    auto point = std::lower_bound(points.begin(), points.end(), middle - kBeside,
                                  [](const auto& p, std::int64_t wanted) { return p.first < wanted; });
    for (; point != points.end() && point->first <= middle + kBeside; ++point)
      if (point->second * slack <= nearness * share && nearness * slack <= point->second * share) return true;
  }
  return false;
}

}  // namespace hueline::fusion
