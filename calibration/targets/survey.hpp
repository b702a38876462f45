#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/frames.hpp"
#include "core/result.hpp"

/// The surveyors' CSV files of stations and sphere targets.
namespace hueline::calibration {

/// The survey's frame: x east, y north, z up, in m. It has projected coordinates or a local grid, at the scale of the
/// scans.
struct Survey {};

/// A sphere target with its surveyed place.
struct SurveyedTarget {
  std::string name;
  Point<Survey> position;  ///< centre of the sphere
  double sigma_m = 0;      ///< one sigma of each coordinate
  double radius_m = 0;
  bool is_check = false;              ///< true: the target is found and compared, but never used for the orientation
  std::vector<std::string> stations;  ///< stations that are to see it; empty: all
};

/// A station of the scanner with its surveyed place.
struct SurveyedStation {
  std::string name;
  Point<Survey> position;         ///< origin of the scanner's frame
  std::optional<double> sigma_m;  ///< If given, the position is an observation. Otherwise it only says where to look.
  std::string scan;               ///< name of the scan's file as written; may be empty
};

/// Values for what a CSV file may leave out.
struct SurveyDefaults {
  double target_sigma_m = 0.003;
  double radius_m = 0;  ///< 0: the file must have the column radius_m
};

/// Reads sphere targets from CSV text. The first line has the names of the columns, in any order. Needed are name,
/// east_m, north_m and up_m; optional are sigma_m, radius_m, role (orientation or check) and stations (names separated
/// by spaces). `file` is the name of the file in messages.
/// Errors: unknown columns, other units, repeated names, empty or non-finite numbers and two targets in one place. The
/// message has the line and says what to do.
Result<std::vector<SurveyedTarget>> parse_targets(const std::string& csv, const std::string& file,
                                                  const SurveyDefaults& defaults);

/// Reads stations from CSV text in the same way. Needed are name, east_m, north_m and up_m; optional are sigma_m and
/// scan.
Result<std::vector<SurveyedStation>> parse_stations(const std::string& csv, const std::string& file);

}  // namespace hueline::calibration
