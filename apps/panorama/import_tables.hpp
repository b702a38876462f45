#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "config/rig.hpp"
#include "storage/map_operation.hpp"
#include "survey/drive_panoramas.hpp"

namespace hueline::apps {

/// Gathers the tables of a drive's panoramas, which lie beside the pictures: panoramas.csv, and those that other
/// programs import (docs/formats.md). Memory: 700 bytes a panorama. Thread safety: none.
class PanoramaTables {
 public:
  /// The coordinates are on the map of the rig's cloud.
  explicit PanoramaTables(const config::Rig& rig) : map_(rig.map) {}

  /// Adds a panorama that lies in the file `name`. Without `is_clockwise` viewers would show it mirrored, and so the
  /// tables of other programs leave it out. Errors: those of storage::MapOperation::create().
  Status add(const survey::DrivePanorama& panorama, const std::string& name, bool is_clockwise);
  /// Writes the tables. Errors: Io.
  Status write(const std::filesystem::path& folder) const;

 private:
  Status set_map(const survey::DrivePanorama& first);

  storage::MapConfig map_;
  std::optional<storage::MapOperation> operation_;
  std::string own_, navvis_, pointerra_, orbit_, mapillary_;
};

}  // namespace hueline::apps
