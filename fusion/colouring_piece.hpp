#pragma once

#include <array>
#include <vector>

#include "fusion/colouring.hpp"

namespace hueline::fusion {

/// Working memory for one batch in the colouring. It is reused.
struct Colouring::Piece {
  std::array<std::uint64_t, kColourStates> by_state{};
  std::vector<int> candidates;   ///< indices of the moments that may give a colour
  std::vector<SeenPlaces> seen;  ///< for each candidate
  Visibility::OfBatch sightings;
  float adaptation = 1;  ///< Radiometry::adaptation() at the batch
};

/// The moment that gives a point its colour.
struct Colouring::Found {
  int moment = -1;  ///< index; -1: there is none
  Sight sight{};
  LineOfSight look = LineOfSight::Clear;
  bool is_hidden = false;  ///< whether something hides the point in a moment that was asked
};

constexpr std::size_t kMostCandidates = 32;

}  // namespace hueline::fusion
