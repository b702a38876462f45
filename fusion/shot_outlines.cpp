#include "fusion/shot_outlines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {

constexpr float kNearer_share = 0.85F, kNearer_m = 0.5F;   // a point this much nearer is before another one
constexpr double kSurface_share = 0.03, kSurface_m = 0.3;  // points nearer to each other belong to one surface
constexpr double kDiffers = 20;                            // CIELAB
constexpr int kColumn_px = 4;
constexpr double kFewestGaps = 0.1;  // as a share of the points; fewer are those of outlines
constexpr std::size_t kFewest = 3;   // points that give a colour
constexpr std::size_t kMost = 128;   // points that are compared with each other; of more, every so many-th is taken

/// CIELAB of an sRGB colour, for a white of D65.
Eigen::Vector3d lab_of(const ShotPoint& p) {
  const auto linear = [](std::uint8_t v) {
    const double c = v / 255.0;
    return c <= 0.04045 ? c / 12.92 : portable::pow((c + 0.055) / 1.055, 2.4);
  };
  const double r = linear(p.red), g = linear(p.green), b = linear(p.blue);
  const auto f = [](double t) { return t > 216.0 / 24389 ? portable::pow(t, 1.0 / 3) : (24389.0 / 27 * t + 16) / 116; };
  const double x = f((0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047),
               y = f(0.2126729 * r + 0.7151522 * g + 0.0721750 * b),
               z = f((0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.08883);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

/// The colour of these points that has the smallest sum of differences to the others.
Eigen::Vector3d medoid(const std::vector<std::size_t>& points, const std::vector<Eigen::Vector3d>& labs) {
  std::vector<Eigen::Vector3d> colours;
  const std::size_t step = (points.size() + kMost - 1) / kMost;
  for (std::size_t i = 0; i < points.size(); i += step) colours.push_back(labs[points[i]]);
  std::size_t best = 0;
  double least = INFINITY;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    double sum = 0;
    for (const Eigen::Vector3d& other : colours) sum += (other - colours[i]).norm();
    if (sum < least) least = sum, best = i;
  }
  return colours[best];
}

bool is_before(const ShotPoint& near, const ShotPoint& far) {
  return near.distance_m < kNearer_share * far.distance_m - kNearer_m;
}

/// The points of an image, in cells.
class Cells {
 public:
  Cells(std::span<const ShotPoint> points, double side_px) : points_(points), side_(side_px) {
    for (std::size_t i = 0; i < points.size(); ++i)
      if (points[i].state == ColourState::Direct) cells_[{column(points[i].u), column(points[i].v)}].push_back(i);
  }
  /// Calls `use` with the index of each point within `reach_px` of another one.
  template <class Use>
  void around(const ShotPoint& p, double reach_px, const Use& use) const {
    const auto reach = static_cast<float>(reach_px);
    for (int x = column(p.u - reach); x <= column(p.u + reach); ++x)
      for (int y = column(p.v - reach); y <= column(p.v + reach); ++y)
        if (const auto cell = cells_.find({x, y}); cell != cells_.end())
          for (const std::size_t i : cell->second)
            if (portable::hypot(points_[i].u - p.u, points_[i].v - p.v) <= reach) use(i);
  }

 private:
  int column(float u) const { return static_cast<int>(std::floor(u / side_)); }
  std::span<const ShotPoint> points_;
  double side_;
  std::map<std::pair<int, int>, std::vector<std::size_t>> cells_;
};

}  // namespace

OutlineFigures judge_outlines(std::span<const Point<Scanner>> places, std::span<const ShotPoint> points,
                              std::span<const ShotPoint> tested, double reach_px) {
  const Cells cells(points, std::max(4.0, reach_px));
  std::vector<std::uint8_t> is_behind(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].state == ColourState::Direct)
      cells.around(points[i], reach_px, [&](std::size_t j) {
        if (is_before(points[j], points[i])) is_behind[i] = 1;
      });
  OutlineFigures out;
  std::vector<Eigen::Vector3d> labs(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].state == ColourState::Direct) labs[i] = lab_of(points[i]);
  std::vector<std::size_t> nearer, own;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (is_behind[i] == 0) continue;
    nearer.clear();
    own.clear();
    const double surface_m = kSurface_m + kSurface_share * points[i].distance_m;
    cells.around(points[i], 3 * reach_px, [&](std::size_t j) {
      if (is_behind[j] != 0) return;
      if ((places[j].xyz - places[i].xyz).norm() < surface_m) {
        own.push_back(j);
      } else if (is_before(points[j], points[i]) &&
                 portable::hypot(points[j].u - points[i].u, points[j].v - points[i].v) <= reach_px) {
        nearer.push_back(j);
      }
    });
    if (nearer.size() < kFewest || own.size() < kFewest) continue;
    const Eigen::Vector3d before = medoid(nearer, labs), surface = medoid(own, labs), here = labs[i];
    if ((before - surface).norm() < kDiffers) continue;
    const std::size_t foreign = (here - before).norm() < (here - surface).norm() ? 1 : 0;
    for (OutlineShare* share : {&out.all, tested[i].is_hidden ? &out.refused : &out.kept}) {
      ++share->judged;
      share->foreign += foreign;
    }
  }
  return out;
}

double ring_gap_px(std::span<const ShotPoint> points) {
  double largest = 0;
  for (const bool is_down : {false, true}) {
    std::map<int, std::vector<float>> lines;
    for (const ShotPoint& p : points)
      if (p.is_in_image) lines[static_cast<int>(is_down ? p.u : p.v) / kColumn_px].push_back(is_down ? p.v : p.u);
    std::vector<float> gaps;
    std::size_t count = 0;
    for (auto& [number, line] : lines) {
      std::sort(line.begin(), line.end());
      count += line.size();
      // What lies nearer together than a line is wide belongs to one ring.
      for (std::size_t i = 1; i < line.size(); ++i)
        if (line[i] - line[i - 1] > kColumn_px) gaps.push_back(line[i] - line[i - 1]);
    }
    if (static_cast<double>(gaps.size()) < kFewestGaps * static_cast<double>(count) || gaps.empty()) continue;
    const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
    std::nth_element(gaps.begin(), middle, gaps.end());
    largest = std::max(largest, static_cast<double>(*middle));
  }
  return largest;
}

}  // namespace hueline::fusion
