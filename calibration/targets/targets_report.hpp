#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibration/targets/station_orientation.hpp"

/// The reports of `hueline calibrate targets`: JSON, HTML and YAML.
namespace hueline::calibration {

/// Facts for the reports that the results do not have.
struct TargetsRunNotes {
  std::string date;                  ///< YYYY-MM-DD
  std::string program;               ///< name, version and revision of the program
  std::vector<std::string> scans;    ///< file and format of each result's scan
  std::vector<std::string> refused;  ///< stations without an orientation, and why
};

/// Returns everything as JSON. Units are in the names; docs/calibration.md describes the frames.
std::string targets_json(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsConfig& config,
                         const TargetsRunNotes& notes);

/// Returns one HTML page without external links: a plan of each station with rings, targets and residuals, and the
/// tables.
std::string targets_page(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsConfig& config,
                         const TargetsRunNotes& notes);

/// Returns the orientations as YAML: T_survey_scanner of each station with the record of its calibration.
std::string targets_yaml(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsRunNotes& notes);

}  // namespace hueline::calibration
