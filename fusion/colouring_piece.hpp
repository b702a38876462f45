#pragma once

#include <array>
#include <vector>

#include "fusion/beam_map.hpp"
#include "fusion/colouring.hpp"

namespace hueline::fusion {

/// Working memory for one batch in the colouring. It is reused.
struct Colouring::Piece {
  std::array<std::uint64_t, kColourStates> by_state{};
  std::vector<int> candidates;   ///< indices of the moments that may give a colour
  std::vector<SeenPlaces> seen;  ///< for each candidate
  SeenPlaces asked;
  float adaptation = 1;  ///< Radiometry::adaptation() at the batch
};

/// The moment that gives a point its colour.
struct Colouring::Found {
  int moment = -1;  ///< index; -1: there is none
  Sight sight{};
  LineOfSight look = LineOfSight::Clear;
  bool is_hidden = false;  ///< whether something hides the point in a moment that was asked
};

/// One turn of a scanner.
struct Colouring::Turn {
  GpsTime time{};  ///< its middle
  Moment::Viewpoint viewpoint;
  BeamMap beams;
};

/// A batch whose returns have their places.
struct Colouring::PlacedBatch {
  StampedLaserBatch batch;
  GeoreferencedBatch placed;
  GpsTime last{};                            ///< its last firing
  std::uint64_t number = 0;                  ///< in the order of placing
  std::vector<std::uint8_t> free, occupied;  ///< for each placed return: how many turns found its place so
  std::uint64_t next_turn = 0;               ///< number of the first turn that was not asked yet
};

constexpr std::size_t kMostCandidates = 32;
/// Whether a place that so many turns found free and occupied belongs to something that moves.
bool is_moving(int free, int occupied);
/// ColouredPoint::moving of that place: 128 or more if is_moving().
int confidence_of_moving(int free, int occupied);

}  // namespace hueline::fusion
