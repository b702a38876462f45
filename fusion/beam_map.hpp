#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fusion/coded_nearness.hpp"
#include "fusion/direction_grid.hpp"

/// What the beams of a scanner say about places that other beams met at other times.
namespace hueline::fusion {

/// How many turns found a place free, and how many found something there, in one word, so that counts of several places
/// are added as numbers are.
struct PresenceCount {
  static constexpr std::uint32_t kMost = 1000;  ///< of each; more turns are not counted
  std::uint32_t bits = 0;
  unsigned free() const { return bits & 0xFFFFU; }
  unsigned occupied() const { return bits >> 16; }
  /// Up to 65 counts can be added.
  PresenceCount& operator+=(PresenceCount other) {
    bits += other.bits;
    return *this;
  }
};

/// How far the beams of one scanner went during one turn, as seen from where the scanner was in the middle of it.
/// Thread safety: one thread adds and finishes; count() may then be called by many.
class BeamMap {
 public:
  explicit BeamMap(const DirectionGrid& grid);
  /// Adds a point that locate() found.
  void add(std::uint32_t cell, float nearness) { nearest_[cell] = std::max(nearest_[cell], coded(nearness)); }
  /// Ends the turn. count() may be called from then on.
  void finish();
  /// Counts for each of the places that locate() found whether the beams say anything about it. It was free if beams
  /// went past it to something farther, and occupied if a beam met something at its distance. `counts` has an element
  /// for each place.
  void count(const SeenPlaces& seen, PresenceCount* counts) const;

 private:
  DirectionGrid grid_;
  std::vector<CodedNearness> nearest_;  // until finish()
  /// The nearest point in a cell and its neighbours, 0 if there is none, and in the upper half the farthest: of the
  /// rows that the beams reach, and a last one of nothing.
  std::vector<std::uint32_t> spans_;
  std::uint32_t first_cell_ = 0;  // of spans_
};

}  // namespace hueline::fusion
