#include "calibration/mount/shot_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "calibration/mount/fast_lens.hpp"
#include "core/angle.hpp"

namespace hueline::calibration {
namespace {

constexpr double kCell = 0.25 * kRadPerDeg;        // cell of the grid in which neighbours are looked for
constexpr double kReachBeside = 1.0 * kRadPerDeg;  // largest angle to the neighbour in the ring
constexpr double kReachAcross = 2.2 * kRadPerDeg;  // largest angle to the neighbour in the next ring
constexpr double kSameRing = 0.1 * kRadPerDeg;     // largest difference of elevation in a ring
constexpr double kHidingCell = 0.3 * kRadPerDeg;   // cell of the grid of nearest returns seen from the lens
constexpr float kHiddenShare = 1.15F, kHidden_m = 0.4F;
constexpr double kMargin = 3.4 * kRadPerDeg;      // beside the image
constexpr float kLeast_m = 0.5F, kMost_m = 1e5F;  // nearer returns are of the vehicle; none is farther
constexpr float kJumpShare = 0.1F;  // An outline is where the range leaves the surface by this share of the range, ...
constexpr float kJump_m = 0.5F, kJumpAloneShare = 0.12F;  // ... and grows by this.
constexpr float kSurfaceShare = 0.05F;                    // Two returns within this share are of one surface.
// Shares of the pairs on a surface whose reflectivity counts as even, and as not changed much. Noise makes many small
// changes.
constexpr double kEvenShare = 0.7, kMuchShare = 0.9;

enum Side : std::size_t { kBefore, kAfter, kBelow, kAbove, kSides };
constexpr std::array<Side, kSides> kOpposite{kAfter, kBefore, kAbove, kBelow};

struct Direction {
  double azimuth, elevation;
  float range;
};

Direction direction_of(const Eigen::Vector3f& p) {
  return {std::atan2(p.y(), p.x()), std::atan2(p.z(), std::hypot(p.x(), p.y())), p.norm()};
}

/// Cells of directions, which list what lies in them.
class DirectionGrid {
 public:
  explicit DirectionGrid(double cell)
      : cell_(cell),
        across_(static_cast<int>(2 * std::numbers::pi / cell) + 1),
        down_(static_cast<int>(std::numbers::pi / cell) + 1) {}
  int column(double azimuth) const {
    return std::clamp(static_cast<int>((azimuth + std::numbers::pi) / cell_), 0, across_ - 1);
  }
  int row(double elevation) const {
    return std::clamp(static_cast<int>((elevation + std::numbers::pi / 2) / cell_), 0, down_ - 1);
  }
  /// Returns the index of a cell; columns continue around the circle.
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(across_) +
           static_cast<std::size_t>(((column % across_) + across_) % across_);
  }
  int rows() const { return down_; }
  std::size_t cells() const { return static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_); }

 private:
  double cell_;
  int across_, down_;
};

/// The nearest return on each side, and the angle to it.
struct Neighbours {
  std::array<std::optional<std::uint32_t>, kSides> which{};
  std::array<float, kSides> angle{static_cast<float>(kReachBeside), static_cast<float>(kReachBeside),
                                  static_cast<float>(kReachAcross), static_cast<float>(kReachAcross)};
};

std::vector<Neighbours> neighbours_of(const std::vector<Direction>& directions) {
  const DirectionGrid grid(kCell);
  std::vector<std::vector<std::uint32_t>> cells(grid.cells());
  for (std::size_t i = 0; i < directions.size(); ++i)
    cells[grid.index(grid.column(directions[i].azimuth), grid.row(directions[i].elevation))].push_back(
        static_cast<std::uint32_t>(i));
  std::vector<Neighbours> out(directions.size());
  constexpr int kRows = static_cast<int>(kReachAcross / kCell) + 1;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Direction& own = directions[i];
    const double narrow = std::max(0.05, std::cos(own.elevation));
    const int column = grid.column(own.azimuth), row = grid.row(own.elevation);
    const int wide = static_cast<int>(kReachBeside / kCell / narrow) + 1,
              slim = static_cast<int>(kReachAcross / 2 / kCell / narrow) + 1;
    const auto consider = [&](std::uint32_t j) {
      if (j == i) return;
      const double up = directions[j].elevation - own.elevation,
                   beside = std::remainder(directions[j].azimuth - own.azimuth, 2 * std::numbers::pi) * narrow;
      const bool is_in_ring = std::abs(up) < kSameRing &&
                              std::abs(up)<0.5 * std::abs(beside), is_across = std::abs(up)> kSameRing &&
                              std::abs(beside) < 0.5 * std::abs(up);
      if (!is_in_ring && !is_across) return;
      const std::size_t side = is_in_ring ? (beside > 0 ? kAfter : kBefore) : (up > 0 ? kAbove : kBelow);
      const auto angle = static_cast<float>(std::hypot(up, beside));
      if (!(angle < out[i].angle[side] && angle > 1e-6F)) return;
      out[i].angle[side] = angle;
      out[i].which[side] = j;
    };
    for (int r = std::max(0, row - kRows); r <= std::min(grid.rows() - 1, row + kRows); ++r) {
      const int reach = std::abs(r - row) <= 1 ? std::max(wide, slim) : slim;
      for (int c = column - reach; c <= column + reach; ++c)
        for (const std::uint32_t j : cells[grid.index(c, r)]) consider(j);
    }
  }
  return out;
}

/// Returns the value below which the given share of `values` lies; 0 if there are none.
float quantile(std::vector<float> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Returns the median angle between neighbours in a ring; 0 without neighbours.
double step_of(const std::vector<Neighbours>& neighbours) {
  std::vector<float> steps;
  for (const Neighbours& one : neighbours)
    if (one.which[kAfter]) steps.push_back(one.angle[kAfter]);
  return static_cast<double>(quantile(steps, 0.5));
}

/// Returns which points lie behind something nearer, seen from the lens. A rotation of the lens does not change it.
std::vector<bool> hidden_from_lens(const std::vector<Eigen::Vector3f>& p_lens) {
  const DirectionGrid grid(kHidingCell);
  std::vector<float> nearest(grid.cells(), std::numeric_limits<float>::infinity());
  std::vector<std::array<int, 2>> places;
  for (const Eigen::Vector3f& p : p_lens) {
    const double flat = std::hypot(p.x(), p.z());
    places.push_back({grid.column(std::atan2(p.x(), p.z())), grid.row(std::atan2(static_cast<double>(p.y()), flat))});
    float& there = nearest[grid.index(places.back()[0], places.back()[1])];
    there = std::min(there, p.norm());
  }
  std::vector<bool> out(p_lens.size());
  for (std::size_t i = 0; i < p_lens.size(); ++i) {
    float around = std::numeric_limits<float>::infinity();
    for (int r = std::max(0, places[i][1] - 1); r <= std::min(grid.rows() - 1, places[i][1] + 1); ++r)
      for (int c = places[i][0] - 1; c <= places[i][0] + 1; ++c) around = std::min(around, nearest[grid.index(c, r)]);
    out[i] = p_lens[i].norm() > around * kHiddenShare + kHidden_m;
  }
  return out;
}

/// Returns what a change of reflectivity counts as, given the sizes from which on it is a change and a large one.
PairKind kind_of(float change, float least, float much) {
  if (!(std::abs(change) > least)) return PairKind::Even;
  if (change > 0) return change < much ? PairKind::Brighter : PairKind::MuchBrighter;
  return change > -much ? PairKind::Darker : PairKind::MuchDarker;
}

/// What lies between a return and its neighbour.
enum class Between { Surface, Outline, Unknown };

/// Compares the range of a neighbour with that which a plane would have. The inverse range of a plane is linear in the
/// angle, so that a road seen at a flat angle has no outlines.
Between between(const std::vector<Direction>& directions, const Neighbours& around, std::size_t own, std::size_t side) {
  const float range = directions[own].range, there = directions[*around.which[side]].range;
  const float share = std::abs(there - range) / std::min(there, range);
  const bool is_far = there - range > kJump_m && share > kJumpAloneShare;
  const auto& opposite = around.which[kOpposite[side]];
  const float ratio = opposite ? around.angle[side] / around.angle[kOpposite[side]] : 0.0F;
  if (!(ratio > 1 / 3.0F && ratio < 3)) {
    if (share < 0.6F * kSurfaceShare) return Between::Surface;
    return is_far && side <= kAfter ? Between::Outline : Between::Unknown;
  }
  const float expected = 1 / range + (1 / range - 1 / directions[*opposite].range) * ratio;
  const float off = (expected - 1 / there) * range;
  if (off > kJumpShare && there - range > kJump_m && share > 0.08F) return Between::Outline;
  return std::abs(off) < kSurfaceShare || share < 0.02F ? Between::Surface : Between::Unknown;
}

/// Returns the direction of a missing return beside `own`, at its range.
Eigen::Vector3f missing_beside(const Direction& own, std::size_t side, double step) {
  const double azimuth = own.azimuth + (side == kAfter ? 1.5 : -1.5) * step / std::max(0.05, std::cos(own.elevation));
  return own.range * Eigen::Vector3d(std::cos(own.elevation) * std::cos(azimuth),
                                     std::cos(own.elevation) * std::sin(azimuth), std::sin(own.elevation))
                         .cast<float>();
}

}  // namespace

LaserPairs laser_pairs(const std::vector<Eigen::Vector3f>& p_scanner, const std::vector<float>& intensity,
                       const Transform<Lens, Scanner>& T_lens_scanner, const LensValues& lens, double max_angle) {
  std::vector<Eigen::Vector3f> points;
  std::vector<float> strengths;
  for (std::size_t i = 0; i < p_scanner.size(); ++i) {
    const float range = p_scanner[i].norm();
    if (!(range > kLeast_m && range < kMost_m)) continue;
    points.push_back(p_scanner[i]);
    strengths.push_back(intensity[i]);
  }
  const Eigen::Matrix3f R = T_lens_scanner.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_lens_scanner.translation.cast<float>();
  std::vector<Direction> directions;
  std::vector<Eigen::Vector3f> p_lens;
  for (const Eigen::Vector3f& p : points) {
    directions.push_back(direction_of(p));
    p_lens.push_back(R * p + t);
  }
  const std::vector<Neighbours> neighbours = neighbours_of(directions);
  const std::vector<bool> is_hidden = hidden_from_lens(p_lens);
  LaserPairs out;
  out.step = step_of(neighbours);
  const FastLens fast = fast_lens(lens, max_angle);
  const auto width = static_cast<float>(lens.width), height = static_cast<float>(lens.height);
  const float margin = static_cast<float>(kMargin) * fast.fx;
  std::vector<float> ranges;
  struct Change {
    std::size_t pair;
    float by;
  };
  std::vector<Change> changes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    float u, v;
    if (is_hidden[i] || !fast.project_lens(p_lens[i], u, v)) continue;
    if (!(u > -margin && v > -margin && u < width + margin && v < height + margin)) continue;
    const int column = std::clamp(static_cast<int>(u / width * kPairColumns), 0, kPairColumns - 1),
              row = std::clamp(static_cast<int>(v / height * kPairRows), 0, kPairRows - 1);
    const auto add = [&](const Eigen::Vector3f& second, PairKind kind) {
      out.pairs.push_back({p_lens[i], second, kind, static_cast<std::uint8_t>(2 * (row * kPairColumns + column))});
      ranges.push_back(p_lens[i].norm());
    };
    const Neighbours& around = neighbours[i];
    for (std::size_t side = 0; side < kSides; ++side) {
      const auto& other = around.which[side];
      if (!other) {
        const auto& opposite = around.which[kOpposite[side]];
        const bool is_end =
            side <= kAfter && opposite && around.angle[kOpposite[side]] < 1.5F * static_cast<float>(out.step) &&
            std::abs(directions[*opposite].range - directions[i].range) < kSurfaceShare * directions[i].range;
        if (is_end) add(R * missing_beside(directions[i], side, out.step) + t, PairKind::OutlineOpen);
        continue;
      }
      const Between what = between(directions, around, i, side);
      if (what == Between::Outline)
        add(R * (points[*other] * (directions[i].range / directions[*other].range)) + t,
            side <= kAfter ? PairKind::OutlineBeside : PairKind::OutlineAcross);
      // Channels differ in their scale of intensities, so that only those of one ring are compared.
      if (what == Between::Surface && side == kAfter && !is_hidden[*other] &&
          around.angle[side] < 3 * static_cast<float>(out.step)) {
        add(p_lens[*other], PairKind::Even);
        changes.push_back({out.pairs.size() - 1, strengths[*other] - strengths[i]});
      }
    }
  }
  std::vector<float> sizes;
  for (const auto& change : changes) sizes.push_back(std::abs(change.by));
  const float least = quantile(sizes, kEvenShare), much = quantile(sizes, kMuchShare);
  for (const auto& change : changes) out.pairs[change.pair].kind = kind_of(change.by, least, much);
  if (ranges.empty()) return out;
  const float middle = quantile(ranges, 0.5);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    out.pairs[i].part = static_cast<std::uint8_t>(out.pairs[i].part + (ranges[i] > middle));
  return out;
}

}  // namespace hueline::calibration
