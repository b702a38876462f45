#pragma once

#include <map>
#include <string>
#include <vector>

#include "storage/mcap_format.hpp"

/// What a recording says about itself, before its first packet.
namespace hueline::storage {

/// One sensor of the rig. Its topic is "/raw/" + name; its SensorId is its place in JournalHeader::sensors.
struct JournalSensor {
  std::string name;    ///< the rig's name for it, e.g. "laser_front"; unique
  std::string device;  ///< what it is, e.g. "velodyne_vlp16"; for people and inspect
  bool operator==(const JournalSensor&) const = default;
};

/// A text that belongs to the recording: the whole rig configuration, calibration.
struct JournalFile {
  std::string name;        ///< e.g. "rig.yaml"
  std::string media_type;  ///< e.g. "application/yaml"
  std::string text;
  bool operator==(const JournalFile&) const = default;
};

struct JournalHeader {
  std::vector<JournalSensor> sensors;  ///< by SensorId; [0] is hueline itself
  std::vector<JournalFile> files;
  std::map<std::string, std::string> about;  ///< "program_version", "git_revision", "rig", ...; keys are free
  bool operator==(const JournalHeader&) const = default;
};

constexpr const char* kJournalProfile = "hueline-raw";  ///< MCAP header
constexpr const char* kJournalMetadata =
    "hueline.journal";  ///< name of the metadata record that holds `about` and "format"
constexpr const char* kJournalFormat = "1";
constexpr const char* kRawPacketSchema = "hueline.RawPacket";
inline std::string raw_topic(const std::string& sensor_name) { return "/raw/" + sensor_name; }

}  // namespace hueline::storage
