#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "calibration/targets/survey.hpp"
#include "storage/scan_file.hpp"

namespace hueline::apps {

/// A scan whose blocks have the scanner at 0 0 0.
struct StationScan {
  storage::ScanFile file;
  std::array<double, 3> origin{};  ///< what was taken away from the file's coordinates
  std::string words;               ///< for people: the file, its format and that origin
};

/// Opens the scan of a station. A scan without a point within 10 km of 0 0 0 (by its first block) has coordinates of a
/// map, in which the scanner is at the station's place: this is taken away. Errors: those of ScanFile; Invalid if the
/// scan is not near the station either.
Result<StationScan> open_station_scan(const std::filesystem::path& path,
                                      const std::optional<storage::ScanFormat>& format,
                                      const calibration::SurveyedStation& station);

}  // namespace hueline::apps
