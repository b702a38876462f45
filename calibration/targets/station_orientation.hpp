#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/targets/detection.hpp"
#include "calibration/targets/matching.hpp"
#include "calibration/targets/orientation.hpp"
#include "calibration/targets/scan_blocks.hpp"
#include "calibration/targets/survey.hpp"

/// Orientation of static scans by sphere targets, from the blocks of the scan to the adjusted orientation
/// (docs/calibration.md, "Sphere targets").
namespace hueline::calibration {

/// Settings of orient_station() and adjust_together().
struct TargetsConfig {
  CentreMethod method = CentreMethod::KnownRadius;  ///< LinearFit is the published method, for comparison
  ScannerNoise noise;
  DetectionConfig detection;
  bool estimate_scale = false;
  double station_doubt_m = 0.05;  ///< largest error of a station's surveyed place that has no sigma
  double most_tilt_deg = 45;      ///< largest tilt of the scanner's z axis
  double least_spread = 0.05;     ///< least width over length of the targets' places; below it they lie on a line
  /// An orientation is refused if its rotation sigma exceeds the first limit, and that sigma moves the outermost target
  /// by more than the second limit times the sigma of a centre. Both are needed: over 100 m 0.05 degrees matter, but
  /// over 3 m they are less than the scanner's range error.
  double most_rotation_sigma_deg = 0.05;
  double most_turn_over_centre = 3;
  double gate_sigma = 4.5;  ///< largest residual of a target against the place that the others give, in sigmas
  unsigned threads = 2;
  std::size_t most_ring_points = 30'000'000;
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// What became of a target.
enum class TargetState {
  Used,      ///< found and part of the orientation
  Check,     ///< found and only compared
  NotSeen,   ///< fewer than 4 points at the expected place
  Rejected,  ///< something was found, but not this target at its surveyed place
};
/// Returns the name of a state in reports.
const char* name(TargetState state);

/// The result for one target.
struct TargetOutcome {
  std::size_t target = 0;  ///< index into the surveyed targets
  TargetState state = TargetState::NotSeen;
  DetectionCounts counts;
  std::string reason;      ///< why it is NotSeen or Rejected
  std::size_t points = 0;  ///< number of points from which the centre was fitted
  double roundness = 0;
  double chi_squared = 0;  ///< chi-squared of the points; its expectation is points - 3
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_scanner = Eigen::Matrix3d::Zero();  ///< includes the common part of the range error
  Eigen::Vector3d residual_survey = Eigen::Vector3d::Zero();     ///< place by the scan minus surveyed place
  /// Sigma that the residual of a Check should have. For a Used target it is the sigma of centre and survey, without
  /// the adjustment.
  Eigen::Vector3d residual_sigma = Eigen::Vector3d::Zero();

  bool is_found() const { return state == TargetState::Used || state == TargetState::Check; }
};

/// The result for one station.
struct StationResult {
  std::size_t station = 0;
  std::vector<TargetOutcome> targets;
  AdjustedStation adjusted;
  double chi_squared = 0;
  int freedom = 0;
  double spread = 0;  ///< width over length of the places of the targets used
  std::uint64_t points_read = 0, ring_points = 0;
  std::vector<Eigen::Vector3d> others_scanner;  ///< spheres of the right size in the rings that are not targets
  double farthest_m = 0;
};

/// Finds the targets of one station and orients its scan by them.
/// Errors: Invalid if the survey and the scan do not fit together or do not determine the orientation; the message says
/// what is wrong, where, and what to do. Otherwise the errors of `scan`.
Result<StationResult> orient_station(const ScanBlocks& scan, std::span<const SurveyedStation> stations,
                                     std::size_t station, std::span<const SurveyedTarget> targets,
                                     const TargetsConfig& config);

/// Adjusts all stations together. Targets that several stations see connect these stations. Replaces the orientations,
/// covariances and residuals of `results`.
Status adjust_together(std::span<StationResult> results, std::span<const SurveyedStation> stations,
                       std::span<const SurveyedTarget> targets, const TargetsConfig& config);

}  // namespace hueline::calibration
