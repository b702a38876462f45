#pragma once

#include <algorithm>

namespace hueline {

/// Returns how many of the 16 bits of samples are empty, of which the largest takes `used_bits` (std::bit_width):
/// cameras of 10, 12 or 14 bits give them in the lower ones. 0: all are used.
constexpr unsigned empty_bits(unsigned used_bits) {
  return used_bits > 14 ? 0 : 16 - std::max(10U, (used_bits + 1) & ~1U);
}

}  // namespace hueline
