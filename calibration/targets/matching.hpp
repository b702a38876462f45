#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/targets/detection.hpp"
#include "calibration/targets/orientation.hpp"

/// Selection of the candidates that are the targets, by mutual distances: docs/methods/sphere_targets.md, step 5.
namespace hueline::calibration {

/// A target with its candidates, before the scan is oriented.
struct TargetToMatch {
  SurveyedPoint surveyed;
  std::vector<Candidate> candidates;  ///< candidates in the target's ring
};

/// Settings of the matching.
struct MatchingConfig {
  double gate_sigma = 4.5;  ///< largest difference between a mutual distance and the surveyed one, in sigmas
  /// Sigma of each centre along its line of sight, in addition to the candidate's covariance.
  double common_range_sigma_m = 0;
  /// Surveyed place of the scanner.
  Eigen::Vector3d station_survey = Eigen::Vector3d::Zero();
  /// Largest distance between the resulting origin of the scanner and its surveyed place.
  double station_doubt_m = 0.25;
  double most_tilt_rad = 0.8;  ///< largest angle between the scanner's z axis and that of the survey
  /// Limit of the search's effort.
  std::size_t most_steps = 3'000'000;
};

/// The candidates selected as targets.
struct Match {
  std::vector<std::optional<std::size_t>> chosen;  ///< for each target: index of its candidate, or nothing
  std::size_t matched = 0;                         ///< number of targets with a candidate
  double chi_squared = 0;                          ///< chi-squared of the mutual distances
  Orientation orientation;                         ///< closed-form orientation from the matched targets
};

/// The reason why nothing was matched, for a message. `best` is the size of the largest set with agreeing distances.
struct MatchFailure {
  std::string reason;
  std::size_t best = 0;
};

/// The match, or the reason why there is none.
struct MatchResult {
  std::optional<Match> match;
  MatchFailure failure;
};

/// Returns the largest set of candidates, at most one for each target, whose mutual distances all equal the surveyed
/// ones. A proper rotation must map the set to the survey with the scanner upright and at its station. A set has at
/// least three candidates.
MatchResult match_by_distances(std::span<const TargetToMatch> targets, const MatchingConfig& config);

/// Returns a candidate or nothing for each target by the published rule (docs/methods equation 22): a candidate is
/// false if less than half of the surveyed distances from its target lead to a candidate of the other targets. If
/// several candidates of a target remain, the roundest is taken.
std::vector<std::optional<std::size_t>> match_by_share(std::span<const TargetToMatch> targets,
                                                       const MatchingConfig& config);

}  // namespace hueline::calibration
