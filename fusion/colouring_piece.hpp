#pragma once

#include <array>
#include <vector>

#include "fusion/colouring.hpp"

namespace hueline::fusion {

/// Scratch of one batch on its way through the colouring; kept for reuse.
struct Colouring::Piece {
  GeoreferencedBatch placed;
  std::array<std::uint64_t, kColourStates> by_state{};
  std::vector<int> candidates;
};

}  // namespace hueline::fusion
