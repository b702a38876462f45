#include "fusion/beam_map.hpp"

#include <algorithm>

namespace hueline::fusion {

BeamMap::BeamMap(const DirectionGrid& grid) : grid_(grid), nearest_(grid.size(), 0.0f) {}

void BeamMap::finish() {
  const auto columns = static_cast<std::size_t>(grid_.columns), rows = static_cast<std::size_t>(grid_.rows);
  const auto join = [](Span a, Span b) {
    if (a.near == 0.0f) return b;
    if (b.near == 0.0f) return a;
    return Span{std::max(a.near, b.near), std::min(a.far, b.far)};
  };
  std::vector<Span> in_row(nearest_.size());
  for (std::size_t row = 0; row < rows; ++row) {
    const float* here = nearest_.data() + row * columns;
    const auto at = [&](std::size_t column) { return Span{here[column], here[column]}; };
    for (std::size_t column = 0; column < columns; ++column) {
      const std::size_t left = column > 0 ? column - 1 : columns - 1, right = column + 1 < columns ? column + 1 : 0;
      in_row[row * columns + column] = join(at(column), join(at(left), at(right)));
    }
  }
  spans_ = in_row;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      Span& span = spans_[row * columns + column];
      if (row > 0) span = join(span, in_row[(row - 1) * columns + column]);
      if (row + 1 < rows) span = join(span, in_row[(row + 1) * columns + column]);
    }
  }
  nearest_ = {};
}

}  // namespace hueline::fusion
