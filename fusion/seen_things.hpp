#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "fusion/object_measurement.hpp"

/// Divides the laser points around a ray into things: groups of points that are linked by small steps.
namespace hueline::fusion {

constexpr std::size_t kFewestOfThing = 6;  ///< fewest points of a thing

/// A point near the ray: `across` are its distances right and up from the ray, `ahead` its distance along the ray, m.
struct NearPoint {
  Eigen::Vector2d across;
  double ahead;
  std::size_t index;
  int thing = -1;
};

/// Returns two directions across the ray, right and up.
std::pair<Eigen::Vector3d, Eigen::Vector3d> across_of(const Eigen::Vector3d& direction);
/// Returns the points within reach, the nearest to the ray first.
std::vector<NearPoint> near_points(const PickedRay& ray, std::span<const SurfacePoint> points,
                                   const ObjectMeasurementConfig& config);
/// Sets the number of each point's thing; points are linked by steps of at most `link_m`. Returns the number of things.
int link_things(std::vector<NearPoint>& near, double link_m);
/// Returns true if a circle of that radius around the origin lies within the points' convex hull. With radius 0: if the
/// points leave no half of the plane free.
bool stand_around(const std::vector<Eigen::Vector2d>& points, double radius_m);
/// Returns, for each thing, how many beams went through it to something at least `behind_m` farther away. Such a thing
/// was not there at that time, or it has gaps.
std::vector<int> beams_through(const std::vector<NearPoint>& near, std::span<const SurfacePoint> points, int things,
                               double behind_m);

}  // namespace hueline::fusion
