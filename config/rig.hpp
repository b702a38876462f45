#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/mount/calibration_watch.hpp"
#include "config/drive_products.hpp"
#include "config/health_limits.hpp"
#include "drivers/device.hpp"
#include "fusion/colouring.hpp"
#include "fusion/rig_geometry.hpp"
#include "storage/cloud_format.hpp"
#include "storage/cloud_split.hpp"
#include "storage/map_config.hpp"
#include "storage/recording_config.hpp"
#include "sync/synchroniser.hpp"

/// A rig file: the sensors of a vehicle, how they are reached, where they are mounted, and what is computed from their
/// data. docs/rig.md lists the keys.
namespace hueline::config {

/// One sensor of a rig.
struct Sensor {
  SensorId id{};
  std::string name;
  double silent_after_s = 3.0;                    ///< connected, but without a packet for this long: a Fault Silent
  const drivers::DeviceType* type = nullptr;      ///< never null in a Rig
  std::shared_ptr<const drivers::Device> device;  ///< made by `type`; never null in a Rig

  /// Returns the word of `driver:` in the rig file.
  const char* driver() const { return type->word; }
};

/// A loaded rig file.
struct Rig {
  std::string name;
  std::string text;             ///< the file as it was read, for the recording
  std::vector<Sensor> sensors;  ///< the id of a sensor is its index + 1
  fusion::RigGeometry geometry;
  sync::Synchroniser::Config sync;
  fusion::Colouring::Config colouring;
  HealthLimits health;
  calibration::CalibrationWatchConfig watch;
  std::vector<std::string> checklist;  ///< what people check before a drive, in their words
  std::vector<std::string> not_known;  ///< what of this file is guessed, in words: the verdict of each drive says so
  double end_within_s = 0;             ///< the end of a drive is cut off after this long; 0: never
  storage::MapConfig map;              ///< of the cloud
  storage::CloudFormat cloud_format = storage::CloudFormat::Las;
  std::optional<storage::CloudSplit> cloud_split{};  ///< the parts that are written beside the cloud; empty: none
  std::optional<PanoramaKeys> panoramas{};           ///< that are made while the vehicle drives; empty: none
  std::optional<ImageKeys> images{};                 ///< likewise
  storage::RecordingConfig recording;

  /// Returns the name of the file of the coloured points.
  const char* cloud_file() const { return storage::cloud_file(cloud_format); }
  /// Returns the names by SensorId; [0] is "hueline".
  std::vector<std::string> sensor_names() const;
};

/// Loads a rig. `path` is a file or the name of a shipped rig (config/shipped.hpp). `types` are the devices that a rig
/// may name. Throws ConfigError with file, line, key, what was found and what is allowed.
Rig load_rig(const std::string& path, drivers::DeviceTypes types = drivers::device_types());
/// Does the same from text. `name` stands for the file in messages.
Rig parse_rig(const std::string& text, const std::string& name, drivers::DeviceTypes types = drivers::device_types());

/// Visits all keys of a rig file, including those of every device.
void visit_rig_keys(Keys& keys, drivers::DeviceTypes types = drivers::device_types());

}  // namespace hueline::config
