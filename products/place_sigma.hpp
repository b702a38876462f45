#pragma once

#include "fusion/trajectory.hpp"

namespace hueline::products {

/// Returns one sigma east, north and up, m, of a point of the vehicle. `arm` leads to it from Body's origin, in Enu:
/// the sigmas of the angles move it across its arm.
inline Eigen::Vector3d place_sigma(const fusion::Pose& pose, const Eigen::Vector3d& arm) {
  const Eigen::Vector3d axes[] = {pose.T_enu_body.rotation * Eigen::Vector3d::UnitY(),
                                  pose.T_enu_body.rotation * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()};
  Eigen::Vector3d variance = pose.sigma_position.cwiseAbs2();
  for (Eigen::Index k = 0; k < 3; ++k) variance += (axes[k].cross(arm) * pose.sigma_attitude[k]).cwiseAbs2();
  return variance.cwiseSqrt();
}

}  // namespace hueline::products
