#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fusion/agreement.hpp"
#include "fusion/colouring.hpp"

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
  ImagePlaces in_image;              ///< of the sights in one camera's image,
  std::vector<std::uint32_t> sight;  ///< their indices in `sights`,
  std::vector<Rgb> samples;          ///< and what the image shows there
  std::vector<Rgb> pixels;           ///< of each sight; then of those that are rendered, with what render_each() needs
  std::vector<std::uint8_t> lenses;
  std::vector<float> off_axis;
  std::vector<std::array<std::uint8_t, 3>> colours;
  std::vector<float> costs;  ///< of one point, for each candidate
  // Of one point: the moments that show its place, and what they show.
  std::vector<Found> views;
  std::vector<Witness> witnesses;
};

/// A place in the image of a camera, as sample() takes it.
struct PlaceInImage {
  int x, y;
  float fx, fy;
};

/// Returns the place in its camera's image of a pixel of a lens.
inline PlaceInImage place_in_image(const FloatLens& lens, float lens_x, float lens_y) {
  // The coordinates are not negative, because they are at least kSampleReach.
  const auto x = static_cast<int>(lens_x), y = static_cast<int>(lens_y);
  return {x + static_cast<int>(lens.x_offset), y + static_cast<int>(lens.y_offset), lens_x - static_cast<float>(x),
          lens_y - static_cast<float>(y)};
}

/// Samples the image of a lens at a sight of that lens.
inline Rgb sample_sight(const FloatLens& lens, const Moment::Picture& picture, const Sight& sight) {
  const auto [x, y, fx, fy] = place_in_image(lens, sight.x, sight.y);
  return sample(picture.view, x, y, fx, fy);
}

}  // namespace hueline::fusion
