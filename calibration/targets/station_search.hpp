#pragma once

#include <vector>

#include "calibration/targets/station_orientation.hpp"

/// A part of orient_station: the search for the targets of one station in its scan.
namespace hueline::calibration {

/// Returns the indices of those of `targets` that this station is to see.
std::vector<std::size_t> targets_of(const SurveyedStation& station, std::span<const SurveyedTarget> targets);

/// Returns the width over the length of a set of places: 0 on a line, 1 if it is as wide as long.
double spread_of(std::span<const Eigen::Vector3d> places);

/// What was found in the rings of one station.
struct StationSearch {
  std::vector<std::size_t> targets;  ///< indices into the surveyed targets
  RingPoints rings;
  std::vector<double> distances;          ///< surveyed distance of each target
  std::vector<RingDetection> detections;  ///< detections of each target
  std::vector<TargetToMatch> to_match;    ///< candidates of each target
  MatchingConfig matching;
  MatchResult result;
};

/// Runs steps 1 to 6. Errors are those of the scan; a search that finds nothing returns a result without a match.
Result<StationSearch> search_station(const ScanBlocks& scan, const SurveyedStation& station,
                                     std::span<const SurveyedTarget> targets, const TargetsConfig& config);

/// Returns the error that explains why a search gave no orientation: what is wrong, where, and what to do. Reads the
/// scan again to see whether it belongs to another station.
Error refusal(const ScanBlocks& scan, std::span<const SurveyedStation> stations, std::size_t station,
              std::span<const SurveyedTarget> targets, const StationSearch& search, const TargetsConfig& config);

}  // namespace hueline::calibration
