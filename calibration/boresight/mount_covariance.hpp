#pragma once

#include <vector>

#include "calibration/boresight/boresight_normals.hpp"

namespace hueline::calibration {

/// Returns the information about the mountings alone, from the data and the prior of the POS. The trajectory correction
/// is eliminated by the Schur complement. The prior of the mountings is not included.
Eigen::MatrixXd mount_information(const BoresightNormals& normals, const TrajectoryCorrection& trajectory);

/// Returns the covariance of an estimation in which some parameters were held at measured values. `information`
/// includes the prior. A held parameter has the error of its measurement, `sigma_held`, and this error propagates into
/// the others:
///   C = C_free + K P K',   K = -(information of the free ones)^-1 (their information with the held ones).
Eigen::MatrixXd covariance_with_held(const Eigen::MatrixXd& information, const std::vector<bool>& held,
                                     double sigma_held);

}  // namespace hueline::calibration
