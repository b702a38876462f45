#include "fusion/beam_map.hpp"

#include <algorithm>

namespace hueline::fusion {

BeamMap::BeamMap(const DirectionGrid& grid) : grid_(grid), nearest_(grid.size(), 0.0f) {}

void BeamMap::finish() {
  constexpr float kNothing = 1e30f;
  const auto columns = static_cast<std::size_t>(grid_.columns), rows = static_cast<std::size_t>(grid_.rows);
  // Each loop is one that compilers turn into vector instructions. Rows go around, so they get a cell at both ends.
  std::vector<float> near(nearest_.size()), far(nearest_.size()), ring_near(columns + 2), ring_far(columns + 2);
  for (std::size_t row = 0; row < rows; ++row) {
    const float* here = nearest_.data() + row * columns;
    for (std::size_t x = 0; x < columns; ++x) {
      ring_near[x + 1] = here[x];
      ring_far[x + 1] = here[x] > 0.0f ? here[x] : kNothing;
    }
    for (std::vector<float>* ring : {&ring_near, &ring_far}) {
      ring->front() = (*ring)[columns];
      ring->back() = (*ring)[1];
    }
    float *near_row = near.data() + row * columns, *far_row = far.data() + row * columns;
    for (std::size_t x = 0; x < columns; ++x) {
      near_row[x] = std::max(std::max(ring_near[x], ring_near[x + 1]), ring_near[x + 2]);
      far_row[x] = std::min(std::min(ring_far[x], ring_far[x + 1]), ring_far[x + 2]);
    }
  }
  spans_.resize(nearest_.size());
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t here = row * columns, below = row > 0 ? here - columns : here,
                      above = row + 1 < rows ? here + columns : here;
    for (std::size_t x = 0; x < columns; ++x)
      spans_[here + x] = {std::max(std::max(near[below + x], near[here + x]), near[above + x]),
                          std::min(std::min(far[below + x], far[here + x]), far[above + x])};
  }
  nearest_ = {};
}

}  // namespace hueline::fusion
