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

/// Static scans oriented from sphere targets, from the scan's blocks to the adjusted orientation (docs/calibration.md,
/// "Sphere targets").
namespace hueline::calibration {

struct TargetsConfig {
  CentreMethod method = CentreMethod::KnownRadius;  ///< LinearFit: as published, for comparison
  ScannerNoise noise;
  DetectionConfig detection;
  bool estimate_scale = false;
  double station_doubt_m = 0.05;  ///< how wrong a station's surveyed place may be where it has no sigma
  double most_tilt_deg = 45;      ///< of the scanner's z axis
  double least_spread = 0.05;     ///< width over length of the targets' places: below, they lie on a line
  /// An orientation is refused if its turn is less certain than this, and moves the outermost target by more than so
  /// many sigmas of a centre: over 100 m 0.05 degrees are much, over 3 m they are less than what the scanner's range
  /// leaves open.
  double most_rotation_sigma_deg = 0.05;
  double most_turn_over_centre = 3;
  double gate_sigma = 4.5;  ///< of a target against where the others put it
  unsigned threads = 2;
  std::size_t most_ring_points = 30'000'000;
  std::string validate() const;
};

enum class TargetState {
  Used,      ///< found, part of the orientation
  Check,     ///< found, compared only
  NotSeen,   ///< fewer than 4 points where it should be
  Rejected,  ///< something is there, but not this target where it was surveyed
};
const char* name(TargetState state);

struct TargetOutcome {
  std::size_t target = 0;  ///< index into the surveyed targets
  TargetState state = TargetState::NotSeen;
  DetectionCounts counts;
  std::string reason;      ///< of NotSeen and Rejected
  std::size_t points = 0;  ///< that made the centre
  double roundness = 0;
  double chi_squared = 0;  ///< of the points, expectation points - 3
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_scanner = Eigen::Matrix3d::Zero();  ///< common part of the range included
  Eigen::Vector3d residual_survey = Eigen::Vector3d::Zero();     ///< scan minus survey
  /// One sigma that the residual of a Check ought to have; of a Used one, that of the centre and survey without the
  /// adjustment.
  Eigen::Vector3d residual_sigma = Eigen::Vector3d::Zero();

  bool is_found() const { return state == TargetState::Used || state == TargetState::Check; }
};

struct StationResult {
  std::size_t station = 0;
  std::vector<TargetOutcome> targets;
  AdjustedStation adjusted;
  double chi_squared = 0;
  int freedom = 0;
  double spread = 0;  ///< width over length of the places of the targets used
  std::uint64_t points_read = 0, ring_points = 0;
  std::vector<Eigen::Vector3d> others_scanner;  ///< spheres of the right size in the rings that are no targets
  double farthest_m = 0;
};

/// Finds the targets of one station and orients its scan by them. Invalid with what, where and what to do where the
/// survey and the scan do not belong together or cannot determine the orientation; else what `scan` reports.
Result<StationResult> orient_station(const ScanBlocks& scan, std::span<const SurveyedStation> stations,
                                     std::size_t station, std::span<const SurveyedTarget> targets,
                                     const TargetsConfig& config);

/// All stations at once: targets that several of them see tie them together. Replaces orientations, covariances and
/// residuals.
Status adjust_together(std::span<StationResult> results, std::span<const SurveyedStation> stations,
                       std::span<const SurveyedTarget> targets, const TargetsConfig& config);

}  // namespace hueline::calibration
