#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/device.hpp"
#include "fusion/colouring.hpp"
#include "fusion/rig_geometry.hpp"
#include "sync/synchroniser.hpp"

/// A rig file: which sensors a vehicle has, how they are reached, where they sit, and what is made of them. docs/rig.md
/// lists the keys.
namespace hueline::config {

struct Sensor {
  SensorId id{};
  std::string name;
  double silent_after_s = 3.0;                    ///< connected without a packet for so long is a Fault Silent
  const drivers::DeviceType* type = nullptr;      ///< never null in a Rig
  std::shared_ptr<const drivers::Device> device;  ///< made by `type`; never null in a Rig

  const char* driver() const { return type->word; }
};

struct Rig {
  std::string name;
  std::string text;             ///< the file as it was read: goes into the recording
  std::vector<Sensor> sensors;  ///< id = place + 1
  fusion::RigGeometry geometry;
  sync::Synchroniser::Config sync;
  fusion::Colouring::Config colouring;
  std::string crs = "utm";  ///< "utm" (zone of the drive's origin) or "EPSG:n"

  /// Code of `crs`; 0: the UTM zone of the drive.
  int epsg() const { return crs == "utm" ? 0 : std::stoi(crs.substr(5)); }
  /// Names by SensorId; [0] is "hueline".
  std::vector<std::string> sensor_names() const;
};

/// ConfigError names file, line, key, what was found and what is allowed. `path`: a file, or a word
/// (config/shipped.hpp). `types`: the devices that a rig may name.
Rig load_rig(const std::string& path, drivers::DeviceTypes types = drivers::device_types());
Rig parse_rig(const std::string& text, const std::string& name, drivers::DeviceTypes types = drivers::device_types());

/// Walks all keys of a rig file, those of every device included.
void visit_rig_keys(Keys& keys, drivers::DeviceTypes types = drivers::device_types());

}  // namespace hueline::config
