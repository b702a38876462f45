#pragma once

#include "calibration/targets/station_orientation.hpp"

/// The inside of orient_station: one station's targets looked for in its scan.
namespace hueline::calibration {

/// Those of `targets` that this station is to see.
std::vector<std::size_t> targets_of(const SurveyedStation& station, std::span<const SurveyedTarget> targets);

/// Width over length of places: 0 on a line, 1 as wide as long.
double spread_of(std::span<const Eigen::Vector3d> places);

/// What was found in the rings of one station.
struct StationSearch {
  std::vector<std::size_t> targets;  ///< indices into the surveyed ones
  RingPoints rings;
  std::vector<double> distances;          ///< surveyed, of each target
  std::vector<RingDetection> detections;  ///< of each target
  std::vector<TargetToMatch> to_match;    ///< of each target
  MatchingConfig matching;
  MatchResult result;
};

/// Steps 1 to 6. Errors are the scan's own; nothing found is a result without a match.
Result<StationSearch> search_station(const ScanBlocks& scan, const SurveyedStation& station,
                                     std::span<const SurveyedTarget> targets, const TargetsConfig& config);

/// Why no orientation came of a search: what, where, what to do. Reads the scan again to see whether it is another
/// station's.
Error refusal(const ScanBlocks& scan, std::span<const SurveyedStation> stations, std::size_t station,
              std::span<const SurveyedTarget> targets, const StationSearch& search, const TargetsConfig& config);

}  // namespace hueline::calibration
