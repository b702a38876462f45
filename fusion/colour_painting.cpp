#include <algorithm>
#include <array>
#include <cmath>

#include "fusion/colouring.hpp"
#include "fusion/colouring_piece.hpp"

/// Samples the images that were chosen, and writes the colours of the points.
namespace hueline::fusion {
namespace {

constexpr float kFullBorder = 64.0f;  // distance from the border, px, from which the quality is not reduced

/// Returns how far stamps can be trusted in this state, 0 to 1.
float trust(SyncState state) {
  switch (state) {
    case SyncState::Locked:
      return 1.0f;
    case SyncState::Holdover:
      return 0.7f;
    case SyncState::Acquiring:
      return 0.5f;
    case SyncState::Unlocked:
      return 0.25f;
  }
  return 0.25f;
}

}  // namespace

const HeadGains* Colouring::gains_of(const Moment& moment, const Piece& piece) const {
  return moment.gains ? &*moment.gains : piece.usual_gains;
}

/// Writes a point's colour, where it is from, and how good it is.
void Colouring::paint(const Moment& moment, const Found& found, const std::array<std::uint8_t, 3>& colour,
                      ColouredPoint& point) const {
  const Sight& sight = found.sight;
  const Moment::Picture& picture = moment.pictures[projector_.lenses()[sight.lens].camera];
  point.red = colour[0];
  point.green = colour[1];
  point.blue = colour[2];
  point.exposure = picture.exposure;
  point.lens = sight.lens;
  if (projector_.method() == ColourMethod::Panorama) {
    const auto [x, y, z] = moment.viewpoint->in_head(point.east, point.north, point.up);
    projector_.panorama_pixel(x, y, z, point.u, point.v);
  } else {
    point.u = sight.x;
    point.v = sight.y;
  }
  const auto away = static_cast<float>(std::abs((point.time - moment.time).count()));
  const auto interval = static_cast<float>(timeline_.interval().count());
  const float timely = interval / (interval + away);
  const float border = std::min(1.0f, sight.border_px / kFullBorder);
  const float stamped = trust(moment.state) * (moment.timing == ExposureTiming::EventMark ? 1.0f : 0.8f);
  point.quality = static_cast<std::uint8_t>(1.0f + 254.0f * timely * border * stamped * found.vouched);
}

/// Renders piece.rendered.
void Colouring::render(const HeadGains* gains, Piece& piece) const {
  Rendered& rendered = piece.rendered;
  rendered.colours.resize(rendered.pixels.size());
  radiometry_.render_each(rendered.pixels, gains, rendered.lenses.data(), rendered.off_axis.data(), piece.adaptation,
                          rendered.colours.data());
}

/// Paints the points of piece.group from what a moment shows at piece.sights, one for each of them. Those that have no
/// pixel, or if `skips_lost_light` one that lost light, get no moment.
void Colouring::paint_group(const Moment& moment, bool skips_lost_light, ColouredPoint* points, Piece& piece) const {
  const Sights& sights = piece.sights;
  const HeadGains* gains = gains_of(moment, piece);
  piece.sampler.sample(projector_.lenses(), moment, sights, piece.pixels);
  piece.rendered.clear();
  std::size_t shown = 0;
  for (std::size_t k = 0; k < piece.group.size(); ++k) {
    const std::uint32_t i = piece.group[k];
    Found& found = piece.found[i];
    const std::uint8_t lens = sights.lens[k];
    if (lens == kNoLens || (skips_lost_light && is_dimmed(gains, lens) && is_saturated(piece.pixels[k]))) {
      found.moment = -1;
      continue;
    }
    found.sight = sights.at(k);
    piece.rendered.add(piece.pixels[k], lens, projector_.lenses()[lens].off_axis(sights.x[k], sights.y[k]));
    piece.group[shown++] = i;
  }
  render(gains, piece);
  for (std::size_t k = 0; k < shown; ++k)
    paint(moment, piece.found[piece.group[k]], piece.rendered.colours[k], points[piece.group[k]]);
}

/// Paints the points whose moment is chosen, where the nearest lens shows them in good light. The others get no moment.
void Colouring::paint_chosen(const PlacedBatch& batch, ColouredPoint* points, Piece& piece) const {
  const RelativePlaces& from = batch.placed.places;
  for (const int candidate : piece.candidates) {
    const Moment& moment = timeline_.at(candidate);
    piece.group.clear();
    for (std::size_t i = 0; i < from.size(); ++i)
      if (piece.found[i].moment == candidate) piece.group.push_back(static_cast<std::uint32_t>(i));
    if (piece.group.empty()) continue;
    piece.gather(from, piece.group);
    projector_.see_each(moment.viewpoint->relative_to(batch.placed.scanner_enu), moment.viewpoint->motion, piece.places,
                        moment.has_image.data(), moment.blind, piece.sights);
    paint_group(moment, config_.choice == ExposureChoice::Visible, points, piece);
  }
}

/// Paints those of piece.rest for which a moment and its pixel were found.
void Colouring::paint_rest(ColouredPoint* points, Piece& piece) const {
  std::vector<int>& moments = piece.candidates;
  moments.clear();
  for (const std::uint32_t i : piece.rest)
    if (const int moment = piece.found[i].moment;
        moment >= 0 && std::find(moments.begin(), moments.end(), moment) == moments.end())
      moments.push_back(moment);
  for (const int moment : moments) {
    piece.group.clear();
    for (const std::uint32_t i : piece.rest)
      if (piece.found[i].moment == moment) piece.group.push_back(i);
    piece.sights.resize(piece.group.size());
    for (std::size_t k = 0; k < piece.group.size(); ++k) piece.sights.set(k, piece.found[piece.group[k]].sight);
    paint_group(timeline_.at(moment), false, points, piece);
  }
}

}  // namespace hueline::fusion
