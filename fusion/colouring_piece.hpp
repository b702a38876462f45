#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fusion/agreement.hpp"
#include "fusion/colouring.hpp"
#include "fusion/sight_sampler.hpp"

namespace hueline::fusion {

/// The moment that gives a point its colour.
struct Colouring::Found {
  int moment = -1;  ///< index; -1: there is none
  Sight sight{};
  LineOfSight look = LineOfSight::Clear;
  bool is_hidden = false;  ///< whether something hides the point in a moment that was asked
};

/// What the POS leapt between a moment and a batch; nothing if it leapt back.
struct LeapBetween {
  float position_m = 0, angle = 0;  // m, rad
};

/// Working memory for one batch in the colouring. It is reused.
struct Colouring::Piece {
  std::array<std::uint64_t, kColourStates> by_state{};
  std::vector<int> candidates;  ///< indices of the moments that may give a colour, the nearest in time first
  Visibility::OfBatch sightings;
  float adaptation = 1;  ///< Radiometry::adaptation() at the batch
  bool is_provisional = false;
  const HeadGains* usual_gains = nullptr;  ///< of moments without gains; for provisional colours
  std::vector<Found> found;                ///< for each point
  // The points that one step looks at: their indices in the batch, and their places.
  std::vector<std::uint32_t> group;
  RelativePlaces places;
  std::array<SeenPlaces, 2> beside;  ///< from the nearest moments before and after
  std::vector<SeenPlaces> seen;      ///< of `places`, for each candidate
  std::vector<LeapBetween> leaps;    ///< between the batch and each candidate
  Sights sights;                     ///< of `places`
  SightSampler sampler;
  std::vector<Rgb> pixels;  ///< of each sight; then of those that are rendered, with what render_each() needs
  std::vector<std::uint8_t> lenses;
  std::vector<float> off_axis;
  std::vector<std::array<std::uint8_t, 3>> colours;
  std::vector<float> costs;  ///< of one point, for each candidate
  // Of one point: the moments that show its place, and what they show.
  std::vector<Found> views;
  std::vector<Witness> witnesses;
};

}  // namespace hueline::fusion
