#include "products/seen_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "products/point_sample.hpp"

namespace hueline::products {
namespace {

using fusion::LineOfSight, fusion::RelativePlaces;

// A place in steps of the local level, in 64 bits: the tile's column and row, then the place in the tile. So the cells
// of a tile, and the tiles of a column, follow one another.
constexpr double kPlaceStep_m = 0.04;
constexpr int kTileBits = 10;                     // steps across a tile: 41 m
constexpr int kPlaneBits = 23, kHeightBits = 18;  // of east and north: 335 km in all; of up: 10 km
constexpr std::int64_t kTileMask = (1 << kTileBits) - 1;
constexpr nanoseconds kTick{20'000'000};
constexpr std::size_t kFirstThinning = std::size_t{1} << 20;
constexpr int kCellBits = 2;                             // cells of 0.16 m
constexpr double kGroundStep_m = 0.16, kGround_m = 2.5;  // what moves reaches down to the ground, at most so far

struct PlaceSteps {
  std::int64_t east, north, up;
  bool is_inside() const {
    return east >= 0 && north >= 0 && up >= 0 && east < (1 << kPlaneBits) && north < (1 << kPlaneBits) &&
           up < (1 << kHeightBits);
  }
};

PlaceSteps steps_of(double east, double north, double up) {
  const auto steps = [](double metres, int bits) {
    const double value = std::floor(metres / kPlaceStep_m) + std::ldexp(1.0, bits - 1);
    return static_cast<std::int64_t>(std::clamp(value, -1.0, std::ldexp(1.0, bits)));
  };
  return {steps(east, kPlaneBits), steps(north, kPlaneBits), steps(up, kHeightBits)};
}

/// The code of a place; `steps` is inside.
std::uint64_t code_of(const PlaceSteps& steps) {
  const auto join = [](std::uint64_t before, std::int64_t value, int bits) {
    return before << bits | static_cast<std::uint64_t>(value);
  };
  constexpr int kTilesBits = kPlaneBits - kTileBits;
  std::uint64_t code = join(0, steps.east >> kTileBits, kTilesBits);
  code = join(code, steps.north >> kTileBits, kTilesBits);
  code = join(code, steps.east & kTileMask, kTileBits);
  code = join(code, steps.north & kTileMask, kTileBits);
  return join(code, steps.up, kHeightBits);
}

/// The middle of the step of a code.
Eigen::Vector3d place_of(std::uint64_t code) {
  const auto take = [&code](int bits) {
    const auto value = static_cast<std::int64_t>(code & ((std::uint64_t{1} << bits) - 1));
    code >>= bits;
    return value;
  };
  const std::int64_t up = take(kHeightBits), north = take(kTileBits), east = take(kTileBits);
  const std::int64_t tile_north = take(kPlaneBits - kTileBits), tile_east = take(kPlaneBits - kTileBits);
  const auto metres = [](std::int64_t steps, int bits) {
    return (static_cast<double>(steps) + 0.5 - std::ldexp(1.0, bits - 1)) * kPlaceStep_m;
  };
  return {metres(tile_east << kTileBits | east, kPlaneBits), metres(tile_north << kTileBits | north, kPlaneBits),
          metres(up, kHeightBits)};
}

/// The bits of a code that tell its cell, for cells of 2^bits steps.
std::uint64_t cell_mask(int bits) {
  const std::int64_t low = (std::int64_t{1} << std::min(bits, kTileBits)) - 1;
  return ~code_of({low, low, low});
}

constexpr int kInTileBits = 2 * kTileBits + kHeightBits;  // of a code: those that tell where it lies in its tile

/// Calls `take` with the range of the elements of `sorted`, by their cells, in each column of the tiles within reach.
template <class Element, class CellOf, class Take>
void each_column(std::span<const Element> sorted, const Eigen::Vector3d& place, double reach, const CellOf& cell_of,
                 const Take& take) {
  const auto clamped = [](std::int64_t step) {
    return std::clamp<std::int64_t>(step, 0, (std::int64_t{1} << kPlaneBits) - 1);
  };
  const PlaceSteps low = steps_of(place.x() - reach, place.y() - reach, 0),
                   high = steps_of(place.x() + reach, place.y() + reach, 0);
  const std::int64_t first = clamped(low.east) >> kTileBits, last = clamped(high.east) >> kTileBits;
  for (std::int64_t column = first; column <= last; ++column) {
    const auto tile = [&](std::int64_t north) {
      return code_of({column << kTileBits, clamped(north) >> kTileBits << kTileBits, 0}) >> kInTileBits;
    };
    const auto before = [&](const Element& element, std::uint64_t wanted) {
      return cell_of(element) >> kInTileBits < wanted;
    };
    const auto begin = std::lower_bound(sorted.begin(), sorted.end(), tile(low.north), before);
    take(begin, std::lower_bound(begin, sorted.end(), tile(high.north) + 1, before));
  }
}

std::int64_t tick_of(GpsTime time) { return count_ns(time) / kTick.count(); }

/// Sorts, and keeps the first one of those for which `key` is the same.
template <class Element, class Key>
void keep_one(std::vector<Element>& elements, const Key& key) {
  std::sort(elements.begin(), elements.end(), [&](const Element& a, const Element& b) {
    const auto of_a = key(a), of_b = key(b);
    return of_a != of_b ? of_a < of_b : a < b;
  });
  elements.erase(std::unique(elements.begin(), elements.end(),
                             [&](const Element& a, const Element& b) { return key(a) == key(b); }),
                 elements.end());
}

constexpr std::array<float, 9> kEnuAxes{1, 0, 0, 0, 1, 0, 0, 0, 1};

void add_place(RelativePlaces& places, const Eigen::Vector3d& from_origin) {
  places.x.push_back(static_cast<float>(from_origin.x()));
  places.y.push_back(static_cast<float>(from_origin.y()));
  places.z.push_back(static_cast<float>(from_origin.z()));
}

/// Puts places into a map of what is seen from `centre`.
class Filler {
 public:
  Filler(fusion::DepthMap& map, const Eigen::Vector3d& centre, double farthest_m)
      : map_(map), centre_(centre), least_(static_cast<float>(1 / farthest_m)) {}
  ~Filler() { flush(); }
  Filler(const Filler&) = delete;
  Filler& operator=(const Filler&) = delete;

  void add(const Eigen::Vector3d& place) {
    add_place(places_, place - centre_);
    if (places_.size() == kPiece) flush();
  }

 private:
  static constexpr std::size_t kPiece = 4096;
  void flush() {
    locate_cells(map_.grid(), {kEnuAxes, {}}, places_, seen_);
    for (std::size_t i = 0; i < seen_.cell.size(); ++i)
      if (seen_.nearness[i] >= least_) map_.add(seen_.cell[i], seen_.nearness[i]);
    places_.resize(0);
  }

  fusion::DepthMap& map_;
  Eigen::Vector3d centre_;
  float least_;
  RelativePlaces places_;
  fusion::SeenPlaces seen_;
};

}  // namespace

SeenPoints::SeenPoints(const Config& config)
    : config_(config),
      memory_(fusion::DepthMap::make_memory()),
      thin_standing_at_(kFirstThinning),
      thin_moving_at_(kFirstThinning),
      standing_bits_(kCellBits),
      moving_bits_(kCellBits) {}

void SeenPoints::add(const CloudBlock& block) {
  for (const ColouredPoint& point : block.points) {
    const PlaceSteps steps = steps_of(point.east, point.north, point.up);
    if (!steps.is_inside()) continue;
    if (is_moving(point))
      moving_.push_back({tick_of(point.time), code_of(steps)});
    else
      standing_.push_back(code_of(steps));
  }
  if (standing_.size() >= thin_standing_at_) thin_standing();
  if (moving_.size() >= thin_moving_at_) thin_moving();
}

/// Keeps one point of each cell.
void SeenPoints::thin_standing() {
  for (;; ++standing_bits_) {
    const std::uint64_t mask = cell_mask(standing_bits_);
    keep_one(standing_, [mask](std::uint64_t cell) { return cell & mask; });
    if (standing_.size() <= config_.most_cells || standing_bits_ == kTileBits) break;
  }
  thin_standing_at_ = std::max(kFirstThinning, 2 * standing_.size());
}

void SeenPoints::thin_moving() {
  for (;; ++moving_bits_) {
    const std::uint64_t mask = cell_mask(moving_bits_);
    keep_one(moving_, [mask](const Passing& one) { return Passing{one.tick, one.cell & mask}; });
    if (moving_.size() <= config_.most_cells / 4 || moving_bits_ == kTileBits) break;
  }
  thin_moving_at_ = std::max(kFirstThinning, 2 * moving_.size());
}

std::vector<std::vector<Observation>> SeenPoints::find(std::span<const ColouredPoint> points,
                                                       std::span<const TakenPicture> pictures,
                                                       std::span<const LensPicture> lenses, fusion::WorkerPool& pool) {
  thin_standing();
  thin_moving();
  std::vector<Placed> placed;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const PlaceSteps steps = steps_of(points[i].east, points[i].north, points[i].up); steps.is_inside())
      placed.push_back({code_of(steps), static_cast<std::uint32_t>(i)});
  std::sort(placed.begin(), placed.end());
  std::vector<std::vector<Observation>> out(pictures.size());
  pool.run(pictures.size(), [&](std::size_t i) {
    out[i] = look(pictures[i], lenses[pictures[i].lens], points, placed, config_.most_observations / pictures.size());
  });
  return out;
}

std::vector<Observation> SeenPoints::look(const TakenPicture& picture, const LensPicture& lens,
                                          std::span<const ColouredPoint> points, std::span<const Placed> placed,
                                          std::size_t most) const {
  const Eigen::Vector3d centre = picture.T_enu_lens.translation;
  const Transform<Lens, Enu> T_lens_enu = picture.T_enu_lens.inverse();
  fusion::DepthMap standing(config_.depth, memory_), moving(config_.depth_of_moving, memory_);
  {
    Filler filler(standing, centre, config_.farthest_m);
    each_column(
        std::span<const std::uint64_t>(standing_), centre, config_.farthest_m, [](std::uint64_t cell) { return cell; },
        [&](auto begin, auto end) {
          for (; begin != end; ++begin) filler.add(place_of(*begin));
        });
  }
  standing.close();
  {
    Filler filler(moving, centre, config_.farthest_m);
    const auto before = [](const Passing& one, std::int64_t tick) { return one.tick < tick; };
    const auto first = std::lower_bound(moving_.begin(), moving_.end(), tick_of(picture.time - config_.glance), before),
               last = std::lower_bound(first, moving_.end(), tick_of(picture.time + config_.glance) + 1, before);
    for (auto one = first; one != last; ++one)
      // What moves stands on the ground, but the beams may have met only its upper part.
      for (double down = 0; down < kGround_m; down += kGroundStep_m)
        filler.add(place_of(one->cell) - down * Eigen::Vector3d::UnitZ());
  }
  moving.close();

  std::vector<Observation> out;
  RelativePlaces places;
  std::vector<Observation> shown;
  each_column(
      placed, centre, config_.farthest_m, [](const Placed& one) { return one.cell; },
      [&](auto begin, auto end) {
        for (; begin != end; ++begin) {
          const ColouredPoint& point = points[begin->point];
          const Eigen::Vector3d place(point.east, point.north, point.up), from = place - centre;
          const double distance = from.norm();
          if (distance > config_.farthest_m || distance < config_.depth.nearest_m) continue;
          const auto pixel = lens.pixel(T_lens_enu * Point<Enu>{place});
          if (!pixel) continue;
          shown.push_back({begin->point, static_cast<float>(pixel->x()), static_cast<float>(pixel->y())});
          add_place(places, from);
        }
      });
  fusion::SeenPlaces seen;
  locate_cells(standing.grid(), {kEnuAxes, {}}, places, seen);
  for (std::size_t i = 0; i < shown.size(); ++i)
    if (standing.look(seen.cell[i], seen.nearness[i]) >= LineOfSight::Guarded &&
        moving.look(seen.cell[i], seen.nearness[i]) == LineOfSight::Clear)
      out.push_back(shown[i]);
  if (out.size() > most) {
    std::nth_element(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(most), out.end(),
                     [](const Observation& a, const Observation& b) {
                       return std::pair(mixed_bits(a.point), a.point) < std::pair(mixed_bits(b.point), b.point);
                     });
    out.resize(most);
  }
  std::sort(out.begin(), out.end(), [](const Observation& a, const Observation& b) { return a.point < b.point; });
  out.shrink_to_fit();
  return out;
}

}  // namespace hueline::products
