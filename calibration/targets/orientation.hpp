#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/targets/survey.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"

/// Orientation of scans: rotation (Rodrigues or Cayley parameters), translation and, optionally, scale. Docs/methods
/// equations 24 to 27.
namespace hueline::calibration {

/// The orientation of a scan: p_survey = scale * R * p_scanner + t.
struct Orientation {
  Transform<Survey, Scanner> T_survey_scanner;
  double scale = 1;

  Eigen::Vector3d survey_from_scanner(const Eigen::Vector3d& p_scanner) const {
    return scale * (T_survey_scanner.rotation * p_scanner) + T_survey_scanner.translation;
  }
};

/// Returns a, b, c of the antisymmetric matrix S with R = (I - S)^-1 (I + S). They are the rotation axis times
/// tan(angle / 2), and S p = (a, b, c) x p. Returns nothing within a hundredth of a degree of a half turn, where they
/// are infinite.
std::optional<Eigen::Vector3d> rodrigues_parameters(const Eigen::Quaterniond& rotation);
/// Returns the rotation of the parameters that rodrigues_parameters() gives.
Eigen::Quaterniond rotation_from_rodrigues(const Eigen::Vector3d& abc);

/// Returns the orientation in closed form with equal weights (Horn), proper rotations only. It is the start of all
/// other computations. It needs at least three points that are not on one line, and returns nothing otherwise.
std::optional<Orientation> orient_closed_form(std::span<const Eigen::Vector3d> scanner,
                                              std::span<const Eigen::Vector3d> survey);
/// Returns the rms residual if a mirror image is allowed as well. It is much smaller than without the mirror only if
/// axes are swapped.
double mirrored_rms(std::span<const Eigen::Vector3d> scanner, std::span<const Eigen::Vector3d> survey);

/// The centre of a target, found in the scan of a station.
struct CentreObservation {
  std::size_t station = 0, target = 0;  ///< indices into the lists of stations and targets
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Identity();  ///< covariance in the scanner's frame, including the common part of the range error
};

/// A place known from the survey, with one sigma for each coordinate.
struct SurveyedPoint {
  Eigen::Vector3d position_survey = Eigen::Vector3d::Zero();
  double sigma_m = 0.003;
};

/// The adjusted orientation of one station.
struct AdjustedStation {
  Orientation orientation;
  /// Covariance of rotation about the survey's axes (rad), origin of the scanner (m) and scale, 7 x 7. The last row and
  /// column are 0 if the scale was fixed.
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();

  /// Returns the covariance of a scanner point's place in the survey, as far as the orientation causes it.
  Eigen::Matrix3d covariance_of(const Eigen::Vector3d& p_scanner) const;
};

/// The result of adjust().
struct Adjustment {
  std::vector<AdjustedStation> stations;
  std::vector<Eigen::Vector3d> targets_survey;    ///< adjusted places of the targets
  std::vector<Eigen::Vector3d> residuals_survey;  ///< for each observation: place by the scan minus surveyed place
  double chi_squared = 0;
  /// Degrees of freedom.
  int freedom = 0;
  int steps = 0;
};

/// Adjusts the orientations of all stations together. The observations are the centres with their covariances and the
/// surveyed places of the targets with theirs. The method is Gauss-Newton with Cayley increments; the targets are
/// eliminated block by block.
/// `start` has one orientation for each station. `station_priors` has the surveyed origins of the scanners that count
/// as observations.
/// Errors: Invalid if there are no targets or stations, if the targets do not determine the orientation of every
/// station, or if the adjustment does not converge.
Result<Adjustment> adjust(std::span<const Orientation> start, std::span<const SurveyedPoint> targets,
                          std::span<const CentreObservation> observations,
                          std::span<const std::optional<SurveyedPoint>> station_priors, bool estimate_scale);

}  // namespace hueline::calibration
