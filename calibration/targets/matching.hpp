#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/targets/detection.hpp"
#include "calibration/targets/orientation.hpp"

/// Which candidates are the targets, by mutual distances: docs/methods/sphere_targets.md, step 5.
namespace hueline::calibration {

/// What is known of a target before the scan is oriented.
struct TargetToMatch {
  SurveyedPoint surveyed;
  std::vector<Candidate> candidates;  ///< of its ring
};

struct MatchingConfig {
  double gate_sigma = 4.5;          ///< of a mutual distance against the surveyed one
  double common_range_sigma_m = 0;  ///< of each centre along its line of sight, beside the candidates' own covariance
  Eigen::Vector3d station_survey = Eigen::Vector3d::Zero();
  double station_doubt_m = 0.25;  ///< how far the scanner's origin may come to lie from its surveyed place
  double most_tilt_rad = 0.8;     ///< of the scanner's z axis against the survey's
  std::size_t most_steps = 3'000'000;
};

struct Match {
  std::vector<std::optional<std::size_t>> chosen;  ///< one entry a target: index of its candidate
  std::size_t matched = 0;
  double chi_squared = 0;   ///< of the mutual distances
  Orientation orientation;  ///< closed form
};

/// Why nothing was matched, for people; `best` is the largest set whose distances agree.
struct MatchFailure {
  std::string reason;
  std::size_t best = 0;
};

struct MatchResult {
  std::optional<Match> match;
  MatchFailure failure;
};

/// The largest set of candidates, at most one a target, all of whose mutual distances are the surveyed ones, which a
/// proper rotation brings to the survey with the scanner upright and at its station. At least three.
MatchResult match_by_distances(std::span<const TargetToMatch> targets, const MatchingConfig& config);

/// As published (docs/methods equation 22): a candidate is false if less than half of the surveyed distances from its
/// target meet a candidate at theirs. Of those left of one target the roundest.
std::vector<std::optional<std::size_t>> match_by_share(std::span<const TargetToMatch> targets,
                                                       const MatchingConfig& config);

}  // namespace hueline::calibration
