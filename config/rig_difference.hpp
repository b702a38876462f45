#pragma once

#include <string>
#include <vector>

namespace hueline::config {

/// A key of one sensor whose value differs between two rigs.
struct KeyDifference {
  std::string key;            ///< its path below the sensor: "udp.ports[0]"
  std::string first, second;  ///< the values as they are written; "absent"
};

/// Compares what two rig files, given as text, say about the sensor of that name. Numbers that are written differently
/// and are equal do not differ, nor does the order of keys. A key that is absent in one of them differs, even if the
/// other has its default. Returns nothing if a rig lacks the sensor. Throws ConfigError for a text that is no YAML.
/// Thread-safe.
std::vector<KeyDifference> sensor_differences(const std::string& first, const std::string& second,
                                              const std::string& sensor);

}  // namespace hueline::config
