#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"
#include "calibration/boresight/patches.hpp"
#include "calibration/boresight/trajectory_correction.hpp"

namespace hueline::calibration {

/// The estimated values: the mountings of all scanners and the corrections of the trajectory. The planes are not part
/// of the state; each plane is the best one for a given state.
struct BoresightState {
  std::vector<Transform<Body, Scanner>> mounts;
  TrajectoryCorrection trajectory;
};

/// Returns the place of a return in Enu, with the mounting and the trajectory correction of `state`:
///   p_enu = p_body + dp + R_enu_body exp(theta) (R_body_scanner p_scanner + lever arm)
/// This is equation (2) of Skaloud and Lichti 2006 with the POS's errors dp and theta added.
Eigen::Vector3d place_return(const BoresightReturn& one, const BoresightState& state);

/// The values from which the weight of a return's distance from its plane is computed.
struct BoresightWeights {
  /// Above 0: scale of a robust weight (Geman and McClure), for the first rounds. 0: least squares with the noise
  /// below.
  double gate_m = 0;
  /// of each scanner: noise that the residuals show, divided by the noise that the rig assumes
  std::vector<double> unit;
  double sigma_angle = 2e-4;  ///< one sigma of a beam's direction, rad
  /// Deviation of a real surface from a plane. The returns that one scanner takes of a patch within one knot interval
  /// share it.
  double surface_m = 0.002;
  /// Least squares only: rms of the error that the returns of the whole drive may have in common in the pattern of one
  /// parameter.
  double systematic_m = 1e-4;
  double reject = 3.5;  ///< a return farther from the plane than this many sigmas does not belong to it
};

/// The normal equations of all patches, and statistics of the returns that they use.
struct BoresightNormals {
  /// Six rows a scanner (rotation about Body's axes in rad, lever arm in m), then the state of the trajectory
  /// correction.
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd without_pos;           ///< information about the mountings if the poses had no error
  std::vector<std::vector<double>> off;  ///< of each scanner: |distance| / sigma of every return, used or not
  std::size_t returns = 0, patches = 0;  ///< number of those used
  double weight = 0;   ///< sum of the weights of the returns used, before the weights are lowered, 1/m^2
  double squares = 0;  ///< sum of the squared distances of the returns used, m^2
  std::vector<std::size_t> of_scanner;  ///< number of returns used of each scanner
  std::array<std::size_t, 3> facing{};  ///< number of patches used that face across the path, along it, and up
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();  ///< sum of n n' over the patches used
};

/// Returns the normal equations of the distances of returns from their planes,
///   e = n' (p_enu - c),   de = n' dp + (q x m)' theta + (R_body_scanner p x m)' turn + m' lever,   m = R_enu_body' n,
/// with q in Body. The plane of each patch (two tilts and a shift) is eliminated by the Schur complement. The prior of
/// the trajectory correction is not included.
///
/// In least squares a hundred thousand returns would count as so many independent observations. Patterns of a hundredth
/// of a millimetre would then seem significant, for example the height of a lever arm times the sine of the vehicle's
/// sway. All weights are therefore lowered together by the factor 1 / (1 + sum of weights * systematic_m^2): the rms
/// effect of a parameter on the returns is never known better than systematic_m.
BoresightNormals boresight_normals(const BoresightDrive& drive, const std::vector<Patch>& patches,
                                   const BoresightState& state, const BoresightWeights& weights);

}  // namespace hueline::calibration
