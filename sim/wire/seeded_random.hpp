#pragma once

#include <cstdint>

#include "sim/noise.hpp"

namespace hueline::sim {

/// Returns the numbers of one stream of noise.hpp one after the other. Equal seeds give equal numbers with every
/// compiler and library, which std::uniform_*_distribution does not guarantee.
class SeededRandom {
 public:
  SeededRandom(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}

  std::uint64_t next() { return counter_bits(seed_, stream_, index_++); }
  /// Returns a number in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11U) * 0x1p-53; }
  /// Returns a whole number in [low, high].
  std::int64_t between(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(next() % (static_cast<std::uint64_t>(high - low) + 1));
  }

 private:
  std::uint64_t seed_, stream_, index_ = 0;
};

}  // namespace hueline::sim
