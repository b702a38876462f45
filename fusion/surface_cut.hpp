#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/seen_things.hpp"

namespace hueline::fusion {

/// Where a thing's surface is cut by a line beside the ray.
struct SurfaceCut {
  int thing = -1;
  double ahead = 0;                                  ///< m along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< right, up, ahead; towards the lens
  double scatter_m = 0, sigma_m = 0;                 ///< of the points about the surface, along its normal; of `ahead`
  double gap_m = 0;                                  ///< from the ray to the nearest point of the thing
  double roughness_m = 0;                            ///< the same of all of its points around the ray
  double width_m = 0;                                ///< rms of the points across the ray, where they are narrower
  double off_m = 0;                                  ///< from where it is cut to the nearest of its points
  std::vector<std::size_t> points;                   ///< of the surface
};

/// The nearest thing that covers the line at `at`, leaving out those with `is_through`.
std::optional<SurfaceCut> first_cut(const std::vector<NearPoint>& near, const std::vector<std::uint8_t>& is_through,
                                    const Eigen::Vector2d& at, const ObjectMeasurementConfig& config);

}  // namespace hueline::fusion
