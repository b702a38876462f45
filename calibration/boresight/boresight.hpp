#pragma once

#include <array>
#include <functional>
#include <string>

#include "calibration/boresight/boresight_drive.hpp"
#include "core/result.hpp"

namespace hueline::calibration {

struct BoresightConfig {
  double sigma_lever_m = 0.02;  ///< how well the lever arm was measured, each axis
  double correlation_s = 90;    ///< of the POS's slow errors
  double knot_s = 1;  ///< between the knots of the way's corrections; a drive of more than 400 has them farther apart
  double least_share = 0.5;       ///< of a lever arm's information; what the data say less of stays as measured
  double weakest_turn_deg = 0.1;  ///< a rotation less certain than this about any axis is refused
  std::size_t fewest_patches = 60;
  std::size_t most_patches = 4500;            ///< more are thinned out, a third of each way to face
  std::size_t most_of_patch = 120;            ///< returns
  double farthest_deg = 3, farthest_m = 0.5;  ///< from the start; farther is refused
  std::function<void(const std::string& stage, double share)> progress;
  std::string validate() const;
};

/// Six values of a scanner: turns about Body's x, y, z, then the lever arm's x, y, z.
using SixValues = std::array<double, 6>;

struct ScannerBoresight {
  std::string name;
  Transform<Body, Scanner> T_body_scanner;
  Eigen::Vector3d boresight_rotation =
      Eigen::Vector3d::Zero();  ///< rotation vector in Scanner: T_body_scanner's rotation = the measured one * it
  Eigen::Vector3d lever_moved_m = Eigen::Vector3d::Zero();  ///< against the measured one
  SixValues sigma{};                                        ///< rad and m
  SixValues sigma_without_pos{};  ///< what it would be if the POS had no error: the laser's part
  SixValues share{};  ///< of the information that comes from the data, 1 - (sigma of the result / sigma before)^2
  std::array<bool, 6> is_determined{};
  std::size_t returns = 0;
  double unit_sigma = 1;  ///< noise found over the noise assumed
};

struct Boresight {
  std::vector<ScannerBoresight> scanners;
  Eigen::MatrixXd covariance;  ///< 6 a scanner, in rad and m
  std::size_t patches = 0, returns = 0;
  std::array<std::size_t, 3> facing{};  ///< patches that face across the way, along it, up
  double rms_m = 0;                     ///< of the returns' distances from their planes
  int rounds = 0;
  bool is_settled = false;  ///< the last round moved nothing by more than a tenth of its sigma
};

/// Mountings of all scanners of a drive by planes that were seen in two passes or more. Conditions on planes after
/// Skaloud and Lichti, "Rigorous approach to bore-sight self-calibration in airborne laser scanning", ISPRS Journal 61
/// (2006) 47-59, equations (2) to (4); here by distances with the planes eliminated, with lever arms, and with the
/// POS's slow errors as unknowns (WayCorrection), without which the stated covariance would be that of the laser's
/// noise. Shares are the diagonal of the averaging kernel (Rodgers, Inverse Methods for Atmospheric Sounding, 2000,
/// section 2.4). From wide voxels and gates to narrow ones, patches looked for anew with each better mounting. The
/// start may be a degree and a decimetre off. Errors: Unavailable, with what is missing and how to drive: no returns,
/// one pass only, too few patches, planes that leave a turn free, an end too far from the start.
Result<Boresight> find_boresight(const BoresightDrive& drive, const BoresightConfig& config);

}  // namespace hueline::calibration
