#include "fusion/seen_things.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {

constexpr std::size_t kMostNear = 1000;  // most points that are used; with denser scanners they lie nearer
// A beam went through a thing if the thing's points stand around it within this distance.
constexpr double kMostThrough_m = 0.2;
// They must also be at least this far from the beam, because noise puts points beside a post.
constexpr double kThroughMargin_m = 0.04;

}  // namespace

std::pair<Eigen::Vector3d, Eigen::Vector3d> across_of(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d right = direction.unitOrthogonal();
  return {right, direction.cross(right)};
}

std::vector<NearPoint> near_points(const PickedRay& ray, std::span<const SurfacePoint> points,
                                   const ObjectMeasurementConfig& config) {
  const auto [right, up] = across_of(ray.direction_enu);
  std::vector<NearPoint> out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d to = points[i].p_enu - ray.from_enu;
    const double ahead = to.dot(ray.direction_enu);
    const Eigen::Vector2d across(to.dot(right), to.dot(up));
    if (ahead > 0 && across.norm() <= std::min(config.reach_m, config.reach * ahead)) out.push_back({across, ahead, i});
  }
  std::sort(out.begin(), out.end(), [](const NearPoint& a, const NearPoint& b) {
    return std::pair(a.across.norm(), a.index) < std::pair(b.across.norm(), b.index);
  });
  if (out.size() > kMostNear) out.resize(kMostNear);
  return out;
}

int link_things(std::vector<NearPoint>& near, double link_m) {
  int things = 0;
  std::vector<std::size_t> open;
  for (std::size_t first = 0; first < near.size(); ++first) {
    if (near[first].thing >= 0) continue;
    near[first].thing = things;
    open.assign(1, first);
    while (!open.empty()) {
      const NearPoint here = near[open.back()];
      open.pop_back();
      for (std::size_t i = 0; i < near.size(); ++i) {
        if (near[i].thing >= 0) continue;
        const double ahead = near[i].ahead - here.ahead;
        if ((near[i].across - here.across).squaredNorm() + ahead * ahead > link_m * link_m) continue;
        near[i].thing = things;
        open.push_back(i);
      }
    }
    ++things;
  }
  return things;
}

bool stand_around(const std::vector<Eigen::Vector2d>& points, double radius_m) {
  constexpr int kDirections = 16;
  for (int k = 0; k < kDirections; ++k) {
    const double turn = 2 * std::numbers::pi * k / kDirections;
    const Eigen::Vector2d direction(portable::cos(turn), portable::sin(turn));
    if (std::none_of(points.begin(), points.end(),
                     [&](const Eigen::Vector2d& p) { return p.dot(direction) > radius_m; }))
      return false;
  }
  return true;
}

std::vector<int> beams_through(const std::vector<NearPoint>& near, std::span<const SurfacePoint> points, int things,
                               double behind_m) {
  std::vector<int> through(static_cast<std::size_t>(things), 0);
  std::vector<std::vector<Eigen::Vector2d>> around(static_cast<std::size_t>(things));
  for (const NearPoint& target : near) {
    const SurfacePoint& hit = points[target.index];
    const double range = (hit.p_enu - hit.from_enu).norm();
    if (!(range > 0)) continue;
    const Eigen::Vector3d beam = (hit.p_enu - hit.from_enu) / range;
    const auto [right, up] = across_of(beam);
    for (auto& some : around) some.clear();
    for (const NearPoint& other : near) {
      if (other.thing == target.thing) continue;
      const Eigen::Vector3d to = points[other.index].p_enu - hit.from_enu;
      const double ahead = to.dot(beam);
      if (ahead <= 0 || ahead > range - behind_m) continue;
      const Eigen::Vector2d across(to.dot(right), to.dot(up));
      if (across.squaredNorm() < kMostThrough_m * kMostThrough_m)
        around[static_cast<std::size_t>(other.thing)].push_back(across);
    }
    for (std::size_t thing = 0; thing < around.size(); ++thing)
      if (around[thing].size() >= kFewestOfThing && stand_around(around[thing], kThroughMargin_m)) ++through[thing];
  }
  return through;
}

}  // namespace hueline::fusion
