#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"
#include "calibration/boresight/patches.hpp"
#include "calibration/boresight/way_correction.hpp"

namespace hueline::calibration {

/// What is estimated: all mountings and the way's corrections. Planes are not part of it: they are the best ones for
/// these.
struct BoresightState {
  std::vector<Transform<Body, Scanner>> mounts;
  WayCorrection way;
};

/// p_enu = p_body + dp + R_enu_body exp(theta) (R_body_scanner p_scanner + lever arm); Skaloud and Lichti 2006,
/// equation (2), with the POS's errors.
Eigen::Vector3d placed(const BoresightReturn& one, const BoresightState& state);

/// How much a distance from its plane weighs.
struct BoresightWeights {
  double gate_m =
      0;  ///< above 0: robust with this scale (Geman and McClure), for starts; 0: least squares with the noise below
  std::vector<double> unit;    ///< of each scanner: true noise over the one assumed
  double sigma_angle = 2e-4;   ///< rad, one sigma of a beam's direction
  double surface_m = 0.002;    ///< what a real plane is not one: common to a patch's returns within a knot's time
  double systematic_m = 1e-4;  ///< least squares: rms of what returns of the whole drive may err in common and in a
                               ///< parameter's own pattern
  double reject = 3.5;         ///< sigmas beyond which a return is not of the plane
};

struct BoresightNormals {
  Eigen::MatrixXd information;  ///< 6 a scanner (turn about Body's axes in rad, lever arm in m), then the way's state
  Eigen::VectorXd gradient;
  Eigen::MatrixXd without_pos;                        ///< information of the mountings if the poses had no error
  std::vector<std::vector<double>> off;               ///< of each scanner: |distance| over its sigma, of all returns
  std::size_t returns = 0, patches = 0;               ///< used
  double weight = 0;                                  ///< sum over the returns used, before it was lowered, 1/m^2
  double squares = 0;                                 ///< of the distances used, m^2
  std::vector<std::size_t> of_scanner;                ///< returns used of each
  std::array<std::size_t, 3> facing{};                ///< patches used
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();  ///< sum of n n' over the patches used
};

/// Normal equations of the distances of returns from their planes,
///   e = n' (p_enu - c),   de = n' dp + (q x m)' theta + (R_body_scanner p x m)' turn + m' lever,   m = R_enu_body' n,
///   q in Body,
/// each patch's plane (two tilts and a shift) eliminated (Schur). The way's prior is not in it.
/// Least squares would take a hundred thousand returns for so many independent witnesses, and believe patterns of a
/// hundredth of a millimetre (a lever arm's height times the sway's sine). Their weights are lowered together, to 1 /
/// (1 + sum of weights systematic_m^2) of themselves: no parameter's effect on the returns, rms, is known better than
/// systematic_m.
BoresightNormals boresight_normals(const BoresightDrive& drive, const std::vector<Patch>& patches,
                                   const BoresightState& state, const BoresightWeights& weights);

}  // namespace hueline::calibration
