#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// Which of several images shows a point, when the laser points leave it open.
namespace hueline::fusion {

/// What an image shows where a point would be.
struct Witness {
  std::array<std::uint8_t, 3> colour{};  ///< as rendered, so that images of different gains can be compared
  float trust = 0;                       ///< how far it is believed to show the point, 0 to 1
  float own_trust = 0;                   ///< the same, less what its colour would suffer from distance and time
};

/// Returns the index of the witness with whom most others agree (docs/methods/visibility.md, equation 34): images that
/// show the point show one colour, the others show whatever happens to be in front of it. Of witnesses with equal
/// support the first. Returns 0 if there is none.
std::size_t most_agreed(std::span<const Witness> witnesses);

}  // namespace hueline::fusion
