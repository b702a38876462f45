#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "fusion/colouring.hpp"
#include "fusion/colouring_piece.hpp"
#include "fusion/worker_pool.hpp"

/// Chooses the exposure that gives a point its colour, and samples the colour.
namespace hueline::fusion {
namespace {

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

Rgb sample_sight(const FloatLens& lens, const Moment::Picture& picture, const Sight& sight) {
  const auto x = static_cast<int>(sight.x),
             y = static_cast<int>(sight.y);  // not negative, because it is at least kSampleReach
  return sample(picture.view, x + static_cast<int>(lens.x_offset), y + static_cast<int>(lens.y_offset),
                sight.x - static_cast<float>(x), sight.y - static_cast<float>(y));
}

constexpr float kFullBorder = 64.0f;              // distance from the border, px, from which the quality is not reduced
constexpr std::size_t kCommonPlaces = 3000;       // points that are looked at to compare the light of a moment's views
constexpr int kComparedMoments = 4;               // earlier moments that a moment is compared with
constexpr nanoseconds kLeastAround{250'000'000};  // their time before and after the moment
constexpr float kEven = 0.12f;        // largest difference around a pixel whose light is compared, as a share
constexpr float kSaturated = 250.0f;  // of a sampled value
constexpr float kEvenReach_px = 2.0f;

/// Returns the light that a lens shows at a sight; 0 in channels that are saturated, too dark, or not uniform around.
std::array<float, 3> comparable_light(const Radiometry& radiometry, const FloatLens& lens,
                                      const Moment::Picture& picture, const Sight& sight) {
  const Rgb middle = sample_sight(lens, picture, sight);
  std::array<float, 3> least{middle.red, middle.green, middle.blue}, most = least;
  for (const auto& [dx, dy] : {std::pair(-1, 0), std::pair(1, 0), std::pair(0, -1), std::pair(0, 1)}) {
    Sight beside = sight;
    beside.x += kEvenReach_px * static_cast<float>(dx);
    beside.y += kEvenReach_px * static_cast<float>(dy);
    const Rgb c = sample_sight(lens, picture, beside);
    const std::array<float, 3> values{c.red, c.green, c.blue};
    for (std::size_t k = 0; k < 3; ++k) {
      least[k] = std::min(least[k], values[k]);
      most[k] = std::max(most[k], values[k]);
    }
  }
  std::array<float, 3> light = radiometry.linear(middle);
  for (std::size_t k = 0; k < 3; ++k)
    if (!Radiometry::is_usable(least[k]) || !Radiometry::is_usable(most[k]) || most[k] - least[k] > kEven * most[k] + 3)
      light[k] = 0;
  return light;
}

}  // namespace

bool Colouring::has_lost_light(const Moment& moment, const Sight& sight) const {
  if (!moment.gains) return false;
  const FloatLens& lens = projector_.lenses()[sight.lens];
  const auto& scale = moment.gains->lenses[sight.lens].scale;
  // A pixel that would saturate at the reference's gain as well has lost nothing.
  if (std::min({scale[0], scale[1], scale[2]}) > 0.95f) return false;
  const Rgb c = sample_sight(lens, moment.pictures[lens.camera], sight);
  return std::max({c.red, c.green, c.blue}) > kSaturated;
}

void Colouring::paint(const Moment& moment, const Found& found, float adaptation, ColouredPoint& point) const {
  const Sight& sight = found.sight;
  const FloatLens& lens = projector_.lenses()[sight.lens];
  const Moment::Picture& picture = moment.pictures[lens.camera];
  const auto colour = radiometry_.render(sample_sight(lens, picture, sight), moment.gains ? &*moment.gains : nullptr,
                                         sight.lens, lens.off_axis(sight.x, sight.y), adaptation);
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
  // How far the laser points vouch for the line of sight.
  constexpr std::array<float, 5> kVouched{0.0f, 0.4f, 0.6f, 0.8f, 1.0f};
  const float vouched =
      config_.choice == ExposureChoice::Visible ? kVouched[static_cast<std::size_t>(found.look)] : 1.0f;
  point.quality = static_cast<std::uint8_t>(1.0f + 254.0f * timely * border * stamped * vouched);
}

/// Colours a point from the moment that sees it most nearly as the scanner did, for the scanner did see it. What may
/// lie between grows with the angle between the two lines.
Colouring::Found Colouring::find_visible(std::size_t index, Piece& piece, const ColouredPoint& point) const {
  constexpr float kStep = 0.17f;            // what one step of LineOfSight costs, as an angle of parallax, rad
  constexpr float kLostLight = 0.25f;       // what a saturated pixel costs, rad
  constexpr float kPerNanosecond = 1e-10f;  // what poses and light drift apart between firing and exposure, rad/ns
  constexpr float kSameLine = 0.02f;        // nothing fits between two lines with this parallax, rad
  constexpr float kUsualSigma_m = 0.1f;     // poses of an undisturbed drive differ less in sigma
  constexpr float kNever = 1e30f;
  constexpr nanoseconds kAtOnce{20'000'000};  // nothing moves far in this time
  const bool moves = piece.sightings[index].is_moving();
  std::array<float, kMostCandidates> parallax;
  const std::size_t count = std::min(piece.candidates.size(), parallax.size());
  for (std::size_t k = 0; k < count; ++k) {
    const auto away = static_cast<float>(std::abs((point.time - timeline_.at(piece.candidates[k]).time).count()));
    // After a leap of the POS its sigma is that of the leap: exposures on the other side see the point elsewhere.
    const float leapt =
        std::max(0.0f, std::abs(timeline_.at(piece.candidates[k]).viewpoint->sigma_m - point.sigma_m) - kUsualSigma_m);
    parallax[k] = piece.seen[k].parallax[index] + kPerNanosecond * away + leapt * piece.seen[k].nearness[index];
  }
  Found found;
  float least = kNever;
  while (count > 0) {
    const auto next = std::min_element(parallax.begin(), parallax.begin() + static_cast<std::ptrdiff_t>(count));
    if (*next >= least) break;
    float cost = *next;
    *next = kNever;
    const auto k = static_cast<std::size_t>(next - parallax.begin());
    const Moment& moment = timeline_.at(piece.candidates[k]);
    const std::uint32_t cell = piece.seen[k].cell[index];
    const float nearness = piece.seen[k].nearness[index];
    LineOfSight look = Visibility::look(moment, cell, nearness);
    if (look == LineOfSight::Hidden && piece.seen[k].parallax[index] < kSameLine) look = LineOfSight::Behind;
    // Where the point was is somewhere else at another moment, unless something as far away was there too.
    const bool has_left = moves && std::chrono::abs(point.time - moment.time) > kAtOnce &&
                          !(moment.glance && moment.glance->meets(cell, nearness));
    if (look == LineOfSight::Hidden || has_left) {
      found.is_hidden = true;
      continue;
    }
    cost += kStep * static_cast<float>(static_cast<int>(LineOfSight::Clear) - static_cast<int>(look));
    if (cost >= least) continue;
    Sight sight;
    if (!sees(moment, point, sight)) continue;
    if (has_lost_light(moment, sight)) cost += kLostLight;
    if (cost >= least) continue;
    found.moment = piece.candidates[k];
    found.sight = sight;
    found.look = look;
    least = cost;
  }
  return found;
}

/// Colours a point from the moment that owns it, or else from the nearest in time that sees its direction.
Colouring::Found Colouring::find_nearest(int owner, bool is_lost, Piece& piece, const ColouredPoint& point) const {
  Found found;
  if (!is_lost && sees(timeline_.at(owner), point, found.sight)) {
    found.moment = owner;
    return found;
  }
  const int per_side = is_lost ? config_.lost_image_neighbours : config_.neighbours;
  const nanoseconds reach = timeline_.interval() * per_side + timeline_.interval() / 2 + config_.window_slack;
  piece.candidates.clear();
  if (per_side > 0) timeline_.neighbours_of(point.time, reach, per_side, owner, piece.candidates);
  for (const int candidate : piece.candidates) {
    if (!sees(timeline_.at(candidate), point, found.sight)) continue;
    found.moment = candidate;
    return found;
  }
  return found;
}

bool Colouring::sees(const Moment& moment, const ColouredPoint& point, Sight& sight) const {
  if (!moment.viewpoint) return false;
  const auto [x, y, z] = moment.viewpoint->in_head(point.east, point.north, point.up);
  return projector_.see(x, y, z, moment.has_image.data(), moment.blind, sight);
}

void Colouring::colour_point(int owner, std::size_t index, Piece& piece, ColouredPoint& point) const {
  // An owner without a pose is treated as a lost image.
  const bool is_lost = owner < 0 || !timeline_.at(owner).viewpoint;
  const Found found = config_.choice == ExposureChoice::Visible ? find_visible(index, piece, point)
                                                                : find_nearest(owner, is_lost, piece, point);
  if (found.moment < 0) {
    const bool has_asked = !is_lost || !piece.candidates.empty();
    point.state = found.is_hidden ? ColourState::Hidden : has_asked ? ColourState::Outside : ColourState::NoExposure;
    return;
  }
  const Moment& moment = timeline_.at(found.moment);
  const bool is_own = found.moment == owner;
  paint(moment, found, piece.adaptation, point);
  point.state = is_own ? ColourState::Direct : ColourState::Neighbour;
}

void Colouring::find_candidates(PlacedBatch& batch, Piece& piece) const {
  const int owner = timeline_.owner_of(batch.batch.time);
  timeline_.neighbours_of(batch.batch.time, neighbour_reach(), config_.neighbours, owner, piece.candidates);
  if (owner >= 0) piece.candidates.push_back(owner);
  std::erase_if(piece.candidates, [&](int index) { return !timeline_.at(index).viewpoint; });
  piece.seen.resize(piece.candidates.size());
  for (std::size_t k = 0; k < piece.candidates.size(); ++k) {
    const Moment::Viewpoint& viewpoint = *timeline_.at(piece.candidates[k]).viewpoint;
    locate(visibility_.grid(), viewpoint.relative_to(batch.placed.scanner_enu), batch.placed.places, piece.seen[k]);
  }
}

void Colouring::colour_piece(PlacedBatch& placed_batch, Piece& piece, ColouredPoint* points) const {
  piece.by_state.fill(0);
  const StampedLaserBatch& batch = placed_batch.batch;
  const GeoreferencedBatch& placed = placed_batch.placed;
  // A batch lasts about a millisecond and a window at least a tenth of a second, so nearly always one moment owns the
  // whole batch.
  const int owner_of_first = timeline_.owner_of(batch.time), owner_of_last = timeline_.owner_of(placed_batch.last);
  const bool is_one_window = owner_of_first == owner_of_last && owner_of_first >= 0;
  piece.sightings = visibility_.sightings(placed_batch);
  // The candidates change with a point's time by less than matters within a batch.
  if (config_.choice == ExposureChoice::Visible) find_candidates(placed_batch, piece);
  piece.adaptation = radiometry_.adaptation(batch.time);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const LaserReturn& r = batch.returns[placed.source[i]];
    ColouredPoint& point = points[i];
    point.east = placed.east[i];
    point.north = placed.north[i];
    point.up = placed.up[i];
    point.sigma_m = placed.sigma_m[i];
    point.time = batch.time + nanoseconds(r.time_offset_ns);
    point.reflectivity = r.reflectivity;
    point.return_number = r.return_number;
    point.return_count = r.return_count;
    point.channel = r.channel;
    point.sensor = batch.sensor;
    point.moving = static_cast<std::uint8_t>(piece.sightings[i].confidence_of_moving());
    colour_point(is_one_window && r.time_offset_ns >= 0 ? owner_of_first : timeline_.owner_of(point.time), i, piece,
                 point);
    ++piece.by_state[static_cast<std::size_t>(point.state)];
  }
}

std::vector<Radiometry::Place> Colouring::common_places(int newest) const {
  const Moment& moment = timeline_.at(newest);
  std::vector<const Moment*> seen_by;
  for (int i = newest; i >= 0 && static_cast<int>(seen_by.size()) <= kComparedMoments; --i)
    if (timeline_.at(i).viewpoint) seen_by.push_back(&timeline_.at(i));
  const nanoseconds around = std::max(timeline_.interval(), kLeastAround);
  const auto is_around = [&](const PlacedBatch& batch) {
    return batch.last >= moment.time - around && batch.batch.time <= moment.time + around;
  };
  std::size_t returns = 0;
  for (const PlacedBatch& batch : placed_)
    if (is_around(batch)) returns += batch.placed.places.size();
  const std::size_t stride = returns / kCommonPlaces + 1;
  std::vector<Radiometry::Place> found, places;
  RelativePlaces relative;
  SeenPlaces seen;
  std::size_t counter = 0;
  for (const PlacedBatch& batch : placed_) {
    if (!is_around(batch)) continue;
    const GeoreferencedBatch& placed = batch.placed;
    relative = {};
    const Visibility::OfBatch sighted = visibility_.sightings(batch);
    for (std::size_t i = 0; i < placed.places.size(); ++i) {
      if (counter++ % stride != 0 || sighted[i].is_moving()) continue;
      relative.x.push_back(placed.places.x[i]);
      relative.y.push_back(placed.places.y[i]);
      relative.z.push_back(placed.places.z[i]);
    }
    places.assign(relative.size(), {});
    for (const Moment* by : seen_by) {
      const RelativeHead head = by->viewpoint->relative_to(placed.scanner_enu);
      locate(visibility_.grid(), head, relative, seen);
      for (std::size_t i = 0; i < relative.size(); ++i) {
        if (by != &moment && places[i].empty()) continue;  // only what the newest moment shows is compared
        if (Visibility::look(*by, seen.cell[i], seen.nearness[i]) != LineOfSight::Clear) continue;
        const auto [x, y, z] = head.place(relative.x[i], relative.y[i], relative.z[i]);
        for (const FloatLens& lens : projector_.lenses()) {
          Sight sight;
          if (by->has_image[lens.camera] == 0 || (by->blind >> lens.index & 1) != 0 || !lens.project(x, y, z, sight) ||
              sight.border_px < kEvenReach_px + kSampleReach ||
              lens.mask.covers(static_cast<std::uint32_t>(sight.x + 0.5f), static_cast<std::uint32_t>(sight.y + 0.5f)))
            continue;
          places[i].push_back({by->serial, lens.index, lens.off_axis(sight.x, sight.y),
                               comparable_light(radiometry_, lens, by->pictures[lens.camera], sight)});
        }
      }
    }
    for (Radiometry::Place& place : places)
      if (place.size() > 1) found.push_back(std::move(place));
  }
  return found;
}

void Colouring::measure_light(GpsTime to) {
  if (config_.radiometry.rendering == Rendering::AsDelivered) return;
  std::vector<int> fresh;
  for (int i = 0; i < static_cast<int>(timeline_.size()); ++i) {
    const Moment& moment = timeline_.at(i);
    const bool is_mapped = moment.standing || config_.choice != ExposureChoice::Visible;
    if (moment.viewpoint && is_mapped && !moment.is_compared && moment.time <= to + neighbour_reach())
      fresh.push_back(i);
  }
  if (fresh.empty()) return;
  std::vector<std::vector<Radiometry::Place>> places(fresh.size());
  pool_->run(fresh.size(), [&](std::size_t k) { places[k] = common_places(fresh[k]); });
  for (std::size_t k = 0; k < fresh.size(); ++k) {
    Moment& moment = timeline_.at(fresh[k]);
    moment.is_compared = true;
    radiometry_.add(moment.serial, moment.time, places[k]);
  }
  for (auto& [serial, gains] : radiometry_.settle(to))
    for (std::size_t i = 0; i < timeline_.size(); ++i)
      if (Moment& moment = timeline_.at(static_cast<int>(i)); moment.serial == serial) moment.gains = gains;
  counts_.gain_pairs = radiometry_.pairs();
  counts_.gain_pairs_unmeasured = radiometry_.pairs_too_few();
}

}  // namespace hueline::fusion
