#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/seen_things.hpp"

namespace hueline::fusion {

/// The place where a line parallel to the ray meets the surface of a thing.
struct SurfaceCut {
  int thing = -1;
  double ahead = 0;                                  ///< m along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< components right, up, ahead; it points towards the lens
  /// rms of the points about the surface along its normal; one sigma of `ahead`.
  double scatter_m = 0, sigma_m = 0;
  double gap_m = 0;                 ///< from the ray to the nearest point of the thing
  double roughness_m = 0;           ///< rms about the surface of all points of the thing around the ray
  double width_m = 0;               ///< rms of the points across the ray, in the direction in which they are narrower
  double off_m = 0;                 ///< from the intersection to the nearest point of the surface
  std::vector<std::size_t> points;  ///< points of the surface
};

/// Returns the nearest thing that covers the line at `at`, without the things with `is_through`.
std::optional<SurfaceCut> first_cut(const std::vector<NearPoint>& near, const std::vector<std::uint8_t>& is_through,
                                    const Eigen::Vector2d& at, const ObjectMeasurementConfig& config);

}  // namespace hueline::fusion
