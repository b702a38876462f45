#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/fleet/plan.hpp"
#include "apps/fleet/task.hpp"
#include "core/geodesy.hpp"
#include "core/result.hpp"

/// The catalogue of many drives: what was driven when and where, with which rig, and what came of it (docs/fleet.md).
namespace hueline::apps {

/// What the watch over the camera head found at the end of a drive, against the rig: `watch` of summary.json
/// (docs/formats.md).
struct CatalogueWatch {
  std::array<double, 3> turn_deg{};  ///< about the head's x, y and z
  double turn_sigma_deg = 0;         ///< the largest of the three
  double late_ms = 0, late_sigma_ms = 0;
};

/// What was wrong with a sensor, or with the drive, for a while.
struct CatalogueTrouble {
  std::string sensor, trouble;  ///< trouble: a word of summary.json, such as "time_sigma"
  std::string cause;            ///< in words, with its figures
  double lasted_s = 0;
};

/// A drive in the catalogue. Empty texts and missing values are not known.
struct CatalogueEntry {
  /// What the drive is known by where several catalogues come together: the folder in which the plan has its results,
  /// whether they are there or not; the recording of a drive without a plan.
  std::string key;
  std::string name, recording, results;  ///< the drive; its recording; the folder of its products
  std::string status, text;              ///< of its task, or "open"; "driven" for a drive without a plan; and why
  std::string verdict;
  std::string begin, end;  ///< ISO 8601, UTC
  std::optional<double> duration_s, path_m, coloured_share;
  std::optional<std::int64_t> points;
  std::string rig, rig_sha256, trajectory_sha256, program;
  std::optional<std::int64_t> recording_bytes;  ///< of all segments
  std::optional<double> fusion_s;               ///< wall time of its task
  std::optional<CatalogueWatch> watch;
  std::vector<std::string> reasons;        ///< of the verdict, the gravest first
  std::vector<CatalogueTrouble> troubles;  ///< warnings and alarms
  std::map<std::string, FleetProduct> products;
  std::vector<Geodetic> places;  ///< one a second, of the POS's good solutions
};

/// Reads what is known of a task's drive. What cannot be read is told in `text` of the entry. Throws nothing.
CatalogueEntry entry_of(const FleetPlan& plan, const FleetTask& task);
/// Returns whether there is a recording of that name, or in the folder of that name. Errors: Io.
Status check_is_there(const std::string& drive);
/// Reads what is known of a drive from its own folder, or of a recording alone. Every product is read for its digest.
CatalogueEntry entry_of(const std::string& drive);

/// Returns the catalogue as a GeoPackage. Errors: Io.
Result<std::string> geopackage_of(const std::vector<CatalogueEntry>& entries);

}  // namespace hueline::apps
