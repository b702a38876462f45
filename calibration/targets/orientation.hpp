#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/targets/survey.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"

/// Rotation (Rodrigues / Cayley), translation and, if asked, scale: docs/methods equations 24 to 27.
namespace hueline::calibration {

/// p_survey = scale * R * p_scanner + t.
struct Orientation {
  Transform<Survey, Scanner> T_survey_scanner;
  double scale = 1;

  Eigen::Vector3d survey_from_scanner(const Eigen::Vector3d& p_scanner) const {
    return scale * (T_survey_scanner.rotation * p_scanner) + T_survey_scanner.translation;
  }
};

/// a, b, c of the antisymmetric matrix S with R = (I - S)^-1 (I + S): the rotation axis times tan(angle / 2), S p = (a,
/// b, c) x p. Empty within a hundredth of a degree of half a turn, where they are infinite.
std::optional<Eigen::Vector3d> rodrigues_parameters(const Eigen::Quaterniond& rotation);
Eigen::Quaterniond rotation_from_rodrigues(const Eigen::Vector3d& abc);

/// Closed form, equal weights (Horn), proper rotations only; the start of everything else. At least three points not on
/// one line.
std::optional<Orientation> orient_closed_form(std::span<const Eigen::Vector3d> scanner,
                                              std::span<const Eigen::Vector3d> survey);
/// Root mean square of what remains when a mirror image is allowed too: far smaller than without only if axes are
/// swapped.
double mirrored_rms(std::span<const Eigen::Vector3d> scanner, std::span<const Eigen::Vector3d> survey);

/// A centre found in a station's scan.
struct CentreObservation {
  std::size_t station = 0, target = 0;  ///< indices into the lists below
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Identity();  ///< in the scanner's frame, the common part of the range included
};

/// A place known from the survey, with its sigma in each coordinate.
struct SurveyedPoint {
  Eigen::Vector3d position_survey = Eigen::Vector3d::Zero();
  double sigma_m = 0.003;
};

struct AdjustedStation {
  Orientation orientation;
  /// Of rotation about the survey's axes (rad), the scanner's origin (m) and scale: 7 x 7; the last row and column are
  /// 0 if scale was fixed.
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();

  /// Of a scanner point's place in the survey frame, from the orientation alone.
  Eigen::Matrix3d covariance_of(const Eigen::Vector3d& p_scanner) const;
};

struct Adjustment {
  std::vector<AdjustedStation> stations;
  std::vector<Eigen::Vector3d> targets_survey;  ///< adjusted
  std::vector<Eigen::Vector3d>
      residuals_survey;  ///< of each observation: from the surveyed place to where the scan puts it
  double chi_squared = 0;
  int freedom = 0;
  int steps = 0;
};

/// All stations together: observed centres with their covariances and the targets' surveyed places with theirs, by
/// Gauss-Newton with Cayley increments; targets eliminated block by block. `start`: one orientation a station.
/// `station_priors`: surveyed scanner origins that are to count as observations. Invalid if a station's orientation is
/// not determined.
Result<Adjustment> adjust(std::span<const Orientation> start, std::span<const SurveyedPoint> targets,
                          std::span<const CentreObservation> observations,
                          std::span<const std::optional<SurveyedPoint>> station_priors, bool estimate_scale);

}  // namespace hueline::calibration
