#pragma once

#include <vector>

#include "calibration/boresight/boresight_normals.hpp"

namespace hueline::calibration {

/// Information about the mountings alone, by the data and the POS's prior: the way is eliminated (Schur). Nothing of
/// the mountings' own prior.
Eigen::MatrixXd mount_information(const BoresightNormals& normals, const WayCorrection& way);

/// Covariance of an estimation by `information` (prior included) in which some parameters were held at measured values:
/// those are as wrong as they were measured (`sigma_held`), and their error goes into the others,
///   C = C_free + K P K',   K = -(information of the free ones)^-1 (their information with the held ones).
Eigen::MatrixXd covariance_with_held(const Eigen::MatrixXd& information, const std::vector<bool>& held,
                                     double sigma_held);

}  // namespace hueline::calibration
