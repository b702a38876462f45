#pragma once

#include <array>
#include <vector>

#include "fusion/colouring.hpp"

namespace hueline::fusion {

/// Working memory for one batch in the colouring. It is reused.
struct Colouring::Piece {
  GeoreferencedBatch placed;
  std::array<std::uint64_t, kColourStates> by_state{};
  std::vector<int> candidates;
};

}  // namespace hueline::fusion
