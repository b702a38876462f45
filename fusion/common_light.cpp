#include <algorithm>
#include <utility>

#include "fusion/colouring.hpp"
#include "fusion/colouring_piece.hpp"
#include "fusion/worker_pool.hpp"

/// Finds the places that several views show, and hands their light to the radiometry.
namespace hueline::fusion {
namespace {

constexpr std::size_t kCommonPlaces = 3000;       // points that are looked at to compare the light of a moment's views
constexpr int kComparedMoments = 4;               // earlier moments that a moment is compared with
constexpr nanoseconds kLeastAround{250'000'000};  // their time before and after the moment
constexpr float kEven = 0.12f;  // largest difference around a pixel whose light is compared, as a share
constexpr float kEvenReach_px = 2.0f;

/// The middle, and what is around it, px.
constexpr std::array<std::array<float, 2>, 5> kLookedAt{
    {{0, 0}, {-kEvenReach_px, 0}, {kEvenReach_px, 0}, {0, -kEvenReach_px}, {0, kEvenReach_px}}};

/// Returns the light of the first of the pixels at kLookedAt; 0 in channels that are saturated, too dark, or not
/// uniform around.
std::array<float, 3> comparable_light(const Radiometry& radiometry, const Rgb* pixels) {
  std::array<float, 3> least{pixels->red, pixels->green, pixels->blue}, most = least;
  for (std::size_t i = 1; i < kLookedAt.size(); ++i) {
    const std::array<float, 3> values{pixels[i].red, pixels[i].green, pixels[i].blue};
    for (std::size_t k = 0; k < 3; ++k) {
      least[k] = std::min(least[k], values[k]);
      most[k] = std::max(most[k], values[k]);
    }
  }
  std::array<float, 3> light = radiometry.linear(*pixels);
  for (std::size_t k = 0; k < 3; ++k)
    if (!Radiometry::is_usable(least[k]) || !Radiometry::is_usable(most[k]) || most[k] - least[k] > kEven * most[k] + 3)
      light[k] = 0;
  return light;
}

}  // namespace

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
  SightSampler sampler;
  Sights sights;  // kLookedAt of each view of a place
  std::vector<Rgb> pixels;
  std::vector<std::size_t> shown;  // the places of these views
  std::size_t next = 0;            // index of the next return that is looked at, counted from the begin of the batch
  for (const PlacedBatch& batch : placed_) {
    if (!is_around(batch)) continue;
    const GeoreferencedBatch& placed = batch.placed;
    relative.x.clear();
    relative.y.clear();
    relative.z.clear();
    const Visibility::OfBatch sighted = visibility_.sightings(batch);
    for (; next < placed.places.size(); next += stride) {
      const std::size_t i = next;
      if (sighted[i].is_moving()) continue;
      relative.x.push_back(placed.places.x[i]);
      relative.y.push_back(placed.places.y[i]);
      relative.z.push_back(placed.places.z[i]);
    }
    next -= placed.places.size();
    places.assign(relative.size(), {});
    for (const Moment* by : seen_by) {
      const RelativeHead head = by->viewpoint->relative_to(placed.scanner_enu);
      locate_cells(visibility_.grid(), head, relative, seen);
      for (const std::uint32_t cell : seen.cell) Visibility::prefetch(*by, cell);
      sights.lens.clear();
      sights.x.clear();
      sights.y.clear();
      shown.clear();
      for (std::size_t i = 0; i < relative.size(); ++i) {
        if (by != &moment && places[i].empty()) continue;  // only what the newest moment shows is compared
        if (Visibility::look(*by, seen.cell[i], seen.nearness[i]) != LineOfSight::Clear) continue;
        const auto [x, y, z] = head.place(relative.x[i], relative.y[i], relative.z[i]);
        for (const FloatLens& lens : projector_.lenses()) {
          Sight sight;
          if (by->has_image[lens.camera] == 0 || (by->blind >> lens.index & 1) != 0 ||
              !lens.project(x, y, z, by->viewpoint->motion, sight) || sight.border_px < kEvenReach_px + kSampleReach ||
              lens.is_at_margin(sight.x, sight.y))
            continue;
          shown.push_back(i);
          for (const auto& [dx, dy] : kLookedAt) {
            sights.lens.push_back(lens.index);
            sights.x.push_back(sight.x + dx);
            sights.y.push_back(sight.y + dy);
          }
        }
      }
      sampler.sample(projector_.lenses(), *by, sights, pixels);
      for (std::size_t k = 0; k < shown.size(); ++k) {
        const std::size_t at = k * kLookedAt.size();
        const FloatLens& lens = projector_.lenses()[sights.lens[at]];
        places[shown[k]].push_back({by->serial, lens.index, lens.off_axis(sights.x[at], sights.y[at]),
                                    comparable_light(radiometry_, &pixels[at])});
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
    radiometry_.add(moment.serial, moment.time, places[k], moment.reported);
  }
  for (auto& [serial, gains] : radiometry_.settle(to))
    for (std::size_t i = 0; i < timeline_.size(); ++i)
      if (Moment& moment = timeline_.at(static_cast<int>(i)); moment.serial == serial) moment.gains = gains;
  counts_.gain_pairs = radiometry_.pairs();
  counts_.gain_pairs_unmeasured = radiometry_.pairs_too_few();
}

}  // namespace hueline::fusion
