#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "fusion/object_measurement.hpp"

/// What the laser saw around a ray, taken apart into things.
namespace hueline::fusion {

constexpr std::size_t kFewestOfThing = 6;  ///< points that make a thing

/// A point beside the ray: right and up across it, ahead along it, m.
struct NearPoint {
  Eigen::Vector2d across;
  double ahead;
  std::size_t index;
  int thing = -1;
};

/// Two directions across the ray.
std::pair<Eigen::Vector3d, Eigen::Vector3d> across_of(const Eigen::Vector3d& direction);
/// Points within reach, nearest to the ray first.
std::vector<NearPoint> near_points(const PickedRay& ray, std::span<const SurfacePoint> points,
                                   const ObjectMeasurementConfig& config);
/// Numbers the things: points linked by steps of at most `link_m`. Returns how many there are.
int link_things(std::vector<NearPoint>& near, double link_m);
/// True if a circle of that radius around the origin lies within the points' hull: with 0, if they leave no half of the
/// plane free.
bool stand_around(const std::vector<Eigen::Vector2d>& points, double radius_m);
/// Beams that went through each thing on their way to something at least `behind_m` farther: it was not there then, or
/// has gaps.
std::vector<int> beams_through(const std::vector<NearPoint>& near, std::span<const SurfacePoint> points, int things,
                               double behind_m);

}  // namespace hueline::fusion
