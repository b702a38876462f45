#include "fusion/surface_cut.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {

// How many of a thing's nearest points must stand around the ray. On an open surface, the probability that all of them
// lie on one side is 3e-6.
constexpr std::size_t kAround = 24;
constexpr double kMostAround_m = 0.25;  // largest distance across the ray of the points that stand around it

/// Calls `use` with the nearest `count` of a thing's points, then with twice as many, and so on while they lie within
/// kMostAround_m, until `use` returns true. A scanner's points stand in lines, so the nearest points may all be of one
/// line.
template <class Use>
bool growing(const std::vector<NearPoint>& near, std::span<const std::size_t> points, const Eigen::Vector2d& at,
             std::size_t count, const Use& use) {
  for (std::size_t n = std::min(count, points.size());; n = std::min(2 * n, points.size())) {
    if (use(points.first(n))) return true;
    if (n == points.size() || (near[points[n]].across - at).norm() > kMostAround_m) return false;
  }
}

/// Fits a surface to the points: their distance along the ray as a plane over their place across the ray, because the
/// noise of ranges is along the ray. Points that stand in a line (a thin post, one line of the scanner) do not
/// determine the slope across the line; that slope is not fitted.
SurfaceCut cut_surface(const std::vector<NearPoint>& near, std::span<const std::size_t> points,
                       const Eigen::Vector2d& at, double narrow_m) {
  const double count = static_cast<double>(points.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double mean_ahead = 0;
  for (const std::size_t i : points) mean += near[i].across / count, mean_ahead += near[i].ahead / count;
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Vector2d mixed = Eigen::Vector2d::Zero();
  for (const std::size_t i : points) {
    const Eigen::Vector2d off = near[i].across - mean;
    spread += off * off.transpose();
    mixed += off * (near[i].ahead - mean_ahead);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(spread);
  SurfaceCut cut;
  cut.width_m = std::sqrt(std::max(0.0, solver.eigenvalues()[0]) / count);
  const Eigen::Vector2d off = at - mean;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double leverage = 1 / count, unknown = 0;
  int unknowns = 1;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d axis = solver.eigenvectors().col(k);
    const double sum = solver.eigenvalues()[k];
    if (std::sqrt(std::max(0.0, sum) / count) < narrow_m) {
      unknown += portable::square(off.dot(axis));
      continue;
    }
    slope += axis * (mixed.dot(axis) / sum);
    leverage += portable::square(off.dot(axis)) / sum;
    ++unknowns;
  }
  double square = 0;
  for (const std::size_t i : points)
    square += portable::square(near[i].ahead - mean_ahead - slope.dot(near[i].across - mean));
  const double noise = std::sqrt(square / std::max(1.0, count - unknowns));
  cut.ahead = mean_ahead + slope.dot(off);
  cut.normal = Eigen::Vector3d(slope.x(), slope.y(), -1).normalized();
  cut.scatter_m = noise * std::abs(cut.normal.z());
  cut.sigma_m = std::sqrt(noise * noise * leverage + unknown);  // an unknown slope counts as 45 degrees
  cut.off_m = 1e9;
  for (const std::size_t i : points)
    cut.off_m = std::min(cut.off_m, portable::hypot((near[i].across - at).norm(), near[i].ahead - cut.ahead));
  cut.points.assign(points.begin(), points.end());
  return cut;
}

}  // namespace

std::optional<SurfaceCut> first_cut(const std::vector<NearPoint>& near, const std::vector<std::uint8_t>& is_through,
                                    const Eigen::Vector2d& at, const ObjectMeasurementConfig& config) {
  std::vector<std::size_t> order(near.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return (near[a].across - at).squaredNorm() < (near[b].across - at).squaredNorm();
  });
  std::vector<std::vector<std::size_t>> nearest(is_through.size());
  for (const std::size_t i : order) nearest[static_cast<std::size_t>(near[i].thing)].push_back(i);
  const int things = static_cast<int>(is_through.size());
  const auto fewest = static_cast<std::size_t>(config.surface_points);
  int best = -1;
  double best_ahead = 0;
  for (int thing = 0; thing < things; ++thing) {
    const auto& points = nearest[static_cast<std::size_t>(thing)];
    if (points.size() < kFewestOfThing) continue;
    if (is_through[static_cast<std::size_t>(thing)]) continue;
    if (!growing(near, points, at, kAround, [&](std::span<const std::size_t> some) {
          std::vector<Eigen::Vector2d> around;
          for (const std::size_t i : some) around.push_back(near[i].across - at);
          return stand_around(around, 0);
        }))
      continue;
    const std::size_t first = std::min(fewest, points.size());
    double ahead = 0;
    for (std::size_t i = 0; i < first; ++i) ahead += near[points[i]].ahead / static_cast<double>(first);
    if (best >= 0 && best_ahead <= ahead) continue;
    best = thing;
    best_ahead = ahead;
  }
  if (best < 0) return std::nullopt;
  const auto& points = nearest[static_cast<std::size_t>(best)];
  SurfaceCut cut;
  growing(near, points, at, fewest, [&](std::span<const std::size_t> some) {
    cut = cut_surface(near, some, at, config.narrow_m);
    return cut.width_m >= config.narrow_m;
  });
  // More points of a post only make it longer. The nearest points determine its place best.
  if (cut.width_m < config.narrow_m)
    cut = cut_surface(near, std::span(points).first(std::min(fewest, points.size())), at, config.narrow_m);
  cut.thing = best;
  cut.gap_m = (near[points[0]].across - at).norm();
  double square = 0, count = 0;
  for (const std::size_t i : points) {
    const Eigen::Vector2d off = near[i].across - at;
    if (off.norm() > kMostAround_m) break;
    const double beyond = (near[i].ahead - cut.ahead) * cut.normal.z() + off.dot(cut.normal.head<2>());
    square += beyond * beyond;
    ++count;
  }
  cut.roughness_m = std::sqrt(square / std::max(1.0, count));
  return cut;
}

}  // namespace hueline::fusion
