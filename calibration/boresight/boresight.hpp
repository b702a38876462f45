#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "calibration/boresight/boresight_drive.hpp"
#include "core/result.hpp"

namespace hueline::calibration {

/// Settings of find_boresight().
struct BoresightConfig {
  double sigma_lever_m = 0.02;  ///< one sigma of the measured lever arm, each axis
  double correlation_s = 90;    ///< correlation time of the POS's slow errors
  /// Time between the knots of the corrections of the trajectory. A drive that would have more than 400 knots has them
  /// farther apart.
  double knot_s = 1;
  /// Least share of the information about a lever-arm value that must come from the data. A value with a smaller share
  /// keeps its measured value.
  double least_share = 0.5;
  double weakest_turn_deg = 0.1;  ///< A result with an axis whose rotation has a larger sigma is refused.
  std::size_t fewest_patches = 60;
  /// More patches are thinned out; each facing (across, along, up) keeps a third while it has that many.
  std::size_t most_patches = 4500;
  std::size_t most_of_patch = 120;  ///< most returns of one patch
  /// A result that is farther from the start, in rotation or in lever arm, is refused.
  double farthest_deg = 3, farthest_m = 0.5;
  /// Called with the running stage and the share of the work that is done, 0 to 1. It may be empty.
  std::function<void(const std::string& stage, double share)> progress;
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// Six values of one scanner: rotations about Body's x, y and z axes (rad), then the lever arm's x, y and z (m).
using SixValues = std::array<double, 6>;

/// The estimated mounting of one scanner.
struct ScannerBoresight {
  std::string name;
  Transform<Body, Scanner> T_body_scanner;
  /// Rotation vector in Scanner. The rotation of T_body_scanner is the measured rotation times this one.
  Eigen::Vector3d boresight_rotation = Eigen::Vector3d::Zero();
  Eigen::Vector3d lever_moved_m = Eigen::Vector3d::Zero();  ///< estimated minus measured lever arm, in Body
  SixValues sigma{};                                        ///< one sigma of each value, rad and m
  SixValues sigma_without_pos{};  ///< one sigma of each value if the POS had no error: the laser's part
  /// Share of each value's information that comes from the data: 1 - (sigma of the result / sigma before)^2.
  SixValues share{};
  std::array<bool, 6> is_determined{};  ///< false: the value is held at its measured value
  std::size_t returns = 0;
  double unit_sigma = 1;  ///< noise that the residuals show, divided by the noise that the rig assumes
};

/// The mountings of all scanners of a drive.
struct Boresight {
  std::vector<ScannerBoresight> scanners;
  Eigen::MatrixXd covariance;  ///< six rows and columns a scanner, in the order of SixValues, rad and m
  std::size_t patches = 0, returns = 0;
  std::array<std::size_t, 3> facing{};  ///< number of patches that face across the path, along it, and up
  double rms_m = 0;                     ///< rms distance of the returns from their planes
  int rounds = 0;
  bool is_settled = false;  ///< true if the last round changed no value by more than a tenth of its sigma
};

/// Estimates the mountings of all scanners of a drive from planes that the drive passed at least twice.
///
/// The conditions are those of Skaloud and Lichti, "Rigorous approach to bore-sight self-calibration in airborne laser
/// scanning", ISPRS Journal 61 (2006) 47-59, equations (2) to (4). This function differs in three points: it minimises
/// distances and eliminates the planes, it also estimates lever arms, and it has the slow errors of the POS as unknowns
/// (TrajectoryCorrection). Without those unknowns the covariance would describe the laser's noise alone. The shares are
/// the diagonal of the averaging kernel (Rodgers, Inverse Methods for Atmospheric Sounding, 2000, section 2.4).
///
/// The estimation goes from large voxels and wide gates to small ones and looks for the patches again with each better
/// mounting. The start may be wrong by a degree and a decimetre.
///
/// Errors: Invalid for a wrong `config`. Unavailable if there are no returns, only one pass, too few patches, planes
/// that leave a rotation undetermined, or a result too far from the start; the message says what is missing and how to
/// drive.
Result<Boresight> find_boresight(const BoresightDrive& drive, const BoresightConfig& config);

}  // namespace hueline::calibration
