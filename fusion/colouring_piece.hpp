#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "fusion/agreement.hpp"
#include "fusion/colouring.hpp"
#include "fusion/sight_judge.hpp"
#include "fusion/sight_sampler.hpp"

namespace hueline::fusion {

/// The moment that gives a point its colour.
struct Colouring::Found {
  int moment = -1;  ///< index; -1: there is none
  Sight sight{};
  LineOfSight look = LineOfSight::Clear;
  float vouched = 1;         ///< how far the laser points, or the images, vouch for the colour, 0 to 1
  bool is_doubtful = false;  ///< whether all that is known has to be weighed, for the laser points leave it open
  bool is_hidden = false;    ///< whether something hides the point in a moment that was asked
};

/// What the POS leapt between a moment and a batch; nothing if it leapt back.
struct LeapBetween {
  float position_m = 0, angle = 0;  // m, rad
};

/// Whether a lens's pixels are rendered darker than they are: one that is saturated has then lost light. If not, it
/// would saturate at the reference's gain as well, and has lost nothing.
inline bool is_dimmed(const HeadGains* gains, std::uint8_t lens) {
  if (gains == nullptr) return false;
  const auto& scale = gains->lenses[lens].scale;
  return std::min({scale[0], scale[1], scale[2]}) <= 0.95f;
}

inline bool is_saturated(const Rgb& pixel) { return std::max({pixel.red, pixel.green, pixel.blue}) > 250.0f; }

/// Pixels with what Radiometry::render_each() needs, and what it makes of them.
struct Rendered {
  std::vector<Rgb> pixels;
  std::vector<std::uint8_t> lenses;
  std::vector<float> off_axis;
  std::vector<std::array<std::uint8_t, 3>> colours;
  void clear() {
    pixels.clear();
    lenses.clear();
    off_axis.clear();
  }
  void add(const Rgb& pixel, std::uint8_t lens, float from_axis) {
    pixels.push_back(pixel);
    lenses.push_back(lens);
    off_axis.push_back(from_axis);
  }
};

/// Working memory for one batch in the colouring. It is reused.
struct Colouring::Piece {
  /// Fills `places` with those of `from` that have these indices.
  void gather(const RelativePlaces& from, const std::vector<std::uint32_t>& indices) {
    places.resize(indices.size());
    for (std::size_t k = 0; k < indices.size(); ++k) {
      const std::uint32_t i = indices[k];
      places.set(k, {from.x[i], from.y[i], from.z[i]});
    }
  }

  std::array<std::uint64_t, kColourStates> by_state{};
  std::vector<int> candidates;  ///< indices of the moments that may give a colour, the nearest in time first
  Visibility::OfBatch sightings;
  float adaptation = 1;  ///< Radiometry::adaptation() at the batch
  bool is_provisional = false;
  const HeadGains* usual_gains = nullptr;  ///< of moments without gains; for provisional colours
  std::vector<Found> found;                ///< for each point
  std::vector<std::uint32_t> rest;         ///< indices of the points that choose_beside() left
  std::vector<std::uint32_t> doubtful;     ///< indices in `rest` of those about which the images are asked
  // The points that one step looks at: their indices, and their places.
  std::vector<std::uint32_t> group;
  RelativePlaces places;
  std::array<SeenPlaces, 2> beside;  ///< from the nearest moments before and after
  std::vector<SeenPlaces> seen;      ///< of `rest`, for each candidate
  std::vector<LeapBetween> leaps;    ///< between the batch and each candidate
  Sights sights;                     ///< of `places`
  SightSampler sampler;
  std::vector<Rgb> pixels;  ///< of each sight
  Rendered rendered;
  std::vector<float> costs;  ///< of one point for each candidate, or of one candidate for each point
  // For each of `doubtful` room for all candidates: the moments that show its place, what they cost beside what may lie
  // between, what they show, and what is known of their lines of sight.
  std::vector<Found> views;
  std::vector<Witness> witnesses;
  std::vector<float> view_costs;
  std::vector<std::uint32_t> rows;  ///< of `evidence`
  SightTable evidence;
  std::vector<float> log_odds;  ///< of the rows of `evidence`
  std::vector<std::uint32_t> witness_count;
  std::vector<float> agreement;  ///< of the witnesses of one point
  bool keeps_judged = false;
  std::vector<JudgedSight> judged;  ///< if `keeps_judged`; `point` counts from the batch's first
};

}  // namespace hueline::fusion
