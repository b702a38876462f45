#include "fusion/object_measurement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/portable_math.hpp"
#include "fusion/surface_cut.hpp"

namespace hueline::fusion {
namespace {

// If the number of beams through a thing is at least this share of its own points, it was not there when they passed.
constexpr double kThroughShare = 0.25;

Error cannot(const std::string& why) { return {ErrorCode::Unavailable, why}; }

/// Returns for each thing whether so many beams went through it that it was not there. It then hides nothing. A thing
/// that a few beams went through may hide something.
std::vector<std::uint8_t> things_not_there(const std::vector<NearPoint>& near, const std::vector<int>& through,
                                           const ObjectMeasurementConfig& config) {
  std::vector<double> own(through.size(), 0);
  for (const NearPoint& one : near) ++own[static_cast<std::size_t>(one.thing)];
  std::vector<std::uint8_t> out;
  for (std::size_t thing = 0; thing < through.size(); ++thing)
    out.push_back(through[thing] >= std::max<double>(config.seen_through, kThroughShare * own[thing]));
  return out;
}

/// Returns the angle between the ray and the normal of the surface, degrees.
double oblique_deg(const SurfaceCut& cut) {
  return portable::acos(std::min(1.0, std::abs(cut.normal.z()))) * 180 / std::numbers::pi;
}

/// Returns an error if what the ray meets is not a solid surface that the laser has measured well.
Status check_surface(const SurfaceCut& cut, int beams_through_it, const std::vector<NearPoint>& near,
                     const ObjectMeasurementConfig& config) {
  if (beams_through_it >= config.seen_through)
    return cannot(fmt::format(
        "not solid: laser beams passed the object at {:.1f} m and hit something behind it (leaves, or an object that "
        "stood there at another time)",
        cut.ahead));
  if (cut.gap_m > config.most_gap_m + config.most_gap * cut.ahead)
    return cannot(
        fmt::format("the nearest laser point of the object at {:.1f} m is {:.2f} m beside where the pixel looks",
                    near[cut.points[0]].ahead, cut.gap_m));
  if (cut.roughness_m > config.most_roughness_m)
    return cannot(
        fmt::format("no surface: around the pixel the laser's points at {:.1f} m are {:.2f} m deep (leaves, wires)",
                    near[cut.points[0]].ahead, cut.roughness_m));
  if (cut.scatter_m > config.most_scatter_m)
    return cannot(fmt::format("no surface: the laser's points at {:.1f} m scatter by {:.2f} m",
                              near[cut.points[0]].ahead, cut.scatter_m));
  const double oblique = oblique_deg(cut);
  if (oblique > config.most_oblique_deg || cut.ahead <= 0 || cut.off_m > config.link_m)
    return cannot(
        fmt::format("the surface at {:.1f} m is seen too flat ({:.0f} deg)", near[cut.points[0]].ahead, oblique));
  return {};
}

/// Checks what the pixel may also mean within its uncertainty: around the ray there must be nothing else before or
/// behind the surface.
Status check_edges(const SurfaceCut& cut, const PickedRay& ray, const std::vector<NearPoint>& near,
                   const std::vector<std::uint8_t>& is_through, const ObjectMeasurementConfig& config) {
  for (int k = 0; k < 8; ++k) {
    const double turn = k * std::numbers::pi / 4, aside = config.edge_sigma * ray.sigma * cut.ahead;
    const auto beside =
        first_cut(near, is_through, aside * Eigen::Vector2d(portable::cos(turn), portable::sin(turn)), config);
    if (!beside)
      return cannot(fmt::format("an edge: the surface at {:.1f} m ends within {:.2f} m of where the pixel looks",
                                cut.ahead, aside));
    if (beside->thing != cut.thing)
      return cannot(fmt::format("an edge: something at {:.1f} m and something at {:.1f} m",
                                std::min(cut.ahead, beside->ahead), std::max(cut.ahead, beside->ahead)));
  }
  return {};
}

/// Returns the covariance of the point where the ray meets the surface. `common_m2` is the variance that the surface's
/// points have in common.
Eigen::Matrix3d covariance_of(const PickedRay& ray, const SurfaceCut& cut, double common_m2) {
  // p = from + d n(mean - from) / n d. Across the ray, p has the error of the direction. Along the ray, it has that
  // error times the surface's slope, and the error of the surface itself.
  const auto [right, up] = across_of(ray.direction_enu);
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  const Eigen::Vector3d axes[2] = {right, up};
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d moved = cut.ahead * (axes[k] - ray.direction_enu * (cut.normal[k] / cut.normal.z()));
    across += ray.sigma * ray.sigma * moved * moved.transpose();
  }
  return across + cut.sigma_m * cut.sigma_m * ray.direction_enu * ray.direction_enu.transpose() +
         common_m2 * Eigen::Matrix3d::Identity();
}

}  // namespace

std::string ObjectMeasurementConfig::validate() const {
  if (!(reach_m >= 0.05 && reach_m <= 10)) return fmt::format("reach_m is {}; allowed: 0.05 to 10 m", reach_m);
  if (!(reach >= 0.001 && reach <= 0.5)) return fmt::format("reach is {}; allowed: 0.001 to 0.5 rad", reach);
  if (!(link_m >= 0.01 && link_m <= 10)) return fmt::format("link_m is {}; allowed: 0.01 to 10 m", link_m);
  if (surface_points < 6 || surface_points > 200)
    return fmt::format("surface_points is {}; allowed: 6 to 200", surface_points);
  if (!(narrow_m >= 0 && narrow_m <= 1)) return fmt::format("narrow_m is {}; allowed: 0 to 1 m", narrow_m);
  if (!(most_scatter_m > 0 && most_scatter_m <= 10))
    return fmt::format("most_scatter_m is {}; allowed: above 0 to 10 m", most_scatter_m);
  if (!(most_roughness_m > 0 && most_roughness_m <= 10))
    return fmt::format("most_roughness_m is {}; allowed: above 0 to 10 m", most_roughness_m);
  if (!(most_gap_m > 0 && most_gap_m <= 10))
    return fmt::format("most_gap_m is {}; allowed: above 0 to 10 m", most_gap_m);
  if (!(most_gap >= 0 && most_gap <= 1)) return fmt::format("most_gap is {}; allowed: 0 to 1 rad", most_gap);
  if (!(most_oblique_deg > 0 && most_oblique_deg < 90))
    return fmt::format("most_oblique_deg is {}; allowed: above 0, below 90", most_oblique_deg);
  if (seen_through < 1 || seen_through > 1000)
    return fmt::format("seen_through is {}; allowed: 1 to 1000", seen_through);
  if (!(edge_sigma >= 0 && edge_sigma <= 10)) return fmt::format("edge_sigma is {}; allowed: 0 to 10", edge_sigma);
  return {};
}

Result<MeasuredObject> measure_object(const PickedRay& ray, std::span<const SurfacePoint> points,
                                      const ObjectMeasurementConfig& config) {
  std::vector<NearPoint> near = near_points(ray, points, config);
  if (near.empty()) return cannot("the laser saw nothing there");
  const auto through = beams_through(near, points, link_things(near, config.link_m), config.link_m);
  const auto is_through = things_not_there(near, through, config);
  const auto cut = first_cut(near, is_through, Eigen::Vector2d::Zero(), config);
  if (!cut)
    return cannot(
        fmt::format("{} laser points are near the pixel, but no object has points all around it", near.size()));
  if (const Status good = check_surface(*cut, through[static_cast<std::size_t>(cut->thing)], near, config); !good.ok())
    return good.error();
  if (const Status alone = check_edges(*cut, ray, near, is_through, config); !alone.ok()) return alone.error();

  MeasuredObject out;
  out.p_enu = ray.from_enu + cut->ahead * ray.direction_enu;
  out.distance_m = cut->ahead;
  out.oblique_deg = oblique_deg(*cut);
  out.scatter_m = cut->scatter_m;
  out.points = static_cast<int>(cut->points.size());
  std::vector<float> seconds;
  double common = 0;
  for (const std::size_t i : cut->points) {
    seconds.push_back(points[near[i].index].seconds);
    common += portable::square(points[near[i].index].sigma_m) / (3.0 * static_cast<double>(cut->points.size()));
  }
  std::nth_element(seconds.begin(), seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2), seconds.end());
  out.seconds = seconds[seconds.size() / 2];
  out.covariance = covariance_of(ray, *cut, common);
  return out;
}

}  // namespace hueline::fusion
