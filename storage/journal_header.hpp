#pragma once

#include <map>
#include <string>
#include <vector>

#include "storage/mcap_format.hpp"

/// What a recording says about itself before its first packet.
namespace hueline::storage {

/// One sensor of the rig. Its topic is "/raw/" + name, and its SensorId is its index in JournalHeader::sensors.
struct JournalSensor {
  std::string name;    ///< name of the sensor in the rig, e.g. "laser_front"; unique
  std::string device;  ///< kind of device, e.g. "velodyne_vlp16"; for people and for `hueline inspect`
  bool operator==(const JournalSensor&) const = default;
};

/// A text that belongs to the recording, such as the whole rig file or a calibration.
struct JournalFile {
  std::string name;        ///< e.g. "rig.yaml"
  std::string media_type;  ///< e.g. "application/yaml"
  std::string text;
  bool operator==(const JournalFile&) const = default;
};

/// The header of a recording: its sensors, its files, and notes about it.
struct JournalHeader {
  std::vector<JournalSensor> sensors;  ///< by SensorId; [0] is hueline itself
  std::vector<JournalFile> files;
  /// "program_version", "git_revision", "rig" and others; any key is allowed.
  std::map<std::string, std::string> about;
  /// Whether packets that name their rows are stored packed (storage/packed_rows.hpp).
  bool has_packed_images = false;
  bool operator==(const JournalHeader&) const = default;
};

constexpr const char* kJournalProfile = "hueline-raw";       ///< profile in the MCAP header
constexpr const char* kJournalMetadata = "hueline.journal";  ///< metadata record with `about` and "format"
constexpr const char* kJournalFormat = "1";
constexpr const char* kPackedJournalFormat = "2";  ///< that of a recording which may have packed images
constexpr const char* kRawPacketSchema = "hueline.RawPacket";
/// Returns the topic of a sensor's packets.
inline std::string raw_topic(const std::string& sensor_name) { return "/raw/" + sensor_name; }

}  // namespace hueline::storage
