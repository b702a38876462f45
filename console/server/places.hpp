#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hueline::console {

/// Where the console finds programs and files, and what is in these folders now. Names of other people are checked:
/// none leads out of its folder. Thread safety: const functions may be called at once; they read the disk.
struct Places {
  std::filesystem::path drives;     ///< a folder for each drive
  std::filesystem::path hueline;    ///< the program
  std::filesystem::path rigs;       ///< rig files (YAML) of the vehicle; may be empty
  std::filesystem::path scenarios;  ///< scenarios that may be driven without devices; empty: none
  double check_hours = 4;           ///< how long the drive will be, for the check of the disk

  static constexpr std::size_t kMostDrives = 5000;  ///< what is beyond is not looked at

  std::vector<std::string> rig_names() const;
  std::vector<std::string> scenario_names() const;
  /// Returns the path of a rig. Errors: Invalid if there is no such rig.
  Result<std::string> rig_path(const std::string& rig) const;
  /// Returns the newest drives with what their summaries say, and how many there are. `running` is the folder of the
  /// drive that is recorded now; it may be empty.
  nlohmann::ordered_json drives_json(const std::filesystem::path& running) const;
  /// Returns the path of a file in the folder of a drive. Errors: Invalid; Unavailable if it is not there.
  Result<std::filesystem::path> file_of(const std::string& drive, const std::string& file) const;
};

/// Returns whether this is the name of a file or folder that people make: not hidden, on one line, and no path.
bool is_entry_name(const std::string& name);

/// Reads a JSON file of at most 64 MB. Returns null if it cannot be read.
nlohmann::ordered_json read_json(const std::filesystem::path& file);

}  // namespace hueline::console
