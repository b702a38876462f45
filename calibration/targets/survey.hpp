#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/frames.hpp"
#include "core/result.hpp"

/// What the surveyors hand over: stations and sphere targets as CSV.
namespace hueline::calibration {

/// The survey's frame: x east, y north, z up, m; projected coordinates or a local grid, at the scale of the scans.
struct Survey {};

struct SurveyedTarget {
  std::string name;
  Point<Survey> position;  ///< centre of the sphere
  double sigma_m = 0;      ///< of each coordinate
  double radius_m = 0;
  bool is_check = false;              ///< found and compared, never used for the orientation
  std::vector<std::string> stations;  ///< that are to see it; empty: any
};

struct SurveyedStation {
  std::string name;
  Point<Survey> position;         ///< origin of the scanner's frame
  std::optional<double> sigma_m;  ///< if given, the position is an observation; else it only says where to look
  std::string scan;               ///< the scan's file as written, may be empty
};

/// What a CSV may leave out.
struct SurveyDefaults {
  double target_sigma_m = 0.003;
  double radius_m = 0;  ///< 0: the file must have radius_m
};

/// First line: names of columns, in any order: name, east_m, north_m, up_m; may have sigma_m, radius_m, role
/// (orientation or check), stations (names parted by spaces). Unknown columns, other units, repeated names, empty or
/// non-finite numbers and two targets in one place are refused with the line and what to do. `file` stands for the file
/// in messages.
Result<std::vector<SurveyedTarget>> parse_targets(const std::string& csv, const std::string& file,
                                                  const SurveyDefaults& defaults);

/// The same for stations: name, east_m, north_m, up_m; may have sigma_m, scan.
Result<std::vector<SurveyedStation>> parse_stations(const std::string& csv, const std::string& file);

}  // namespace hueline::calibration
