#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibration/targets/station_orientation.hpp"

/// What `hueline calibrate targets` hands over: for programs, for people, for other tools.
namespace hueline::calibration {

/// What the report says beside the figures.
struct TargetsRunNotes {
  std::string date;                  ///< YYYY-MM-DD
  std::string program;               ///< name, version and revision
  std::vector<std::string> scans;    ///< of each result: file and format
  std::vector<std::string> refused;  ///< stations without an orientation, and why
};

/// Everything as JSON. Units are in the names; frames: docs/calibration.md.
std::string targets_json(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsConfig& config,
                         const TargetsRunNotes& notes);

/// One HTML page that needs nothing else: each station's plan with rings, targets and residuals, and the tables.
std::string targets_page(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsConfig& config,
                         const TargetsRunNotes& notes);

/// The orientations as YAML: T_survey_scanner of each station with the record of its calibration.
std::string targets_yaml(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsRunNotes& notes);

}  // namespace hueline::calibration
