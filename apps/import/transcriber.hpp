#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "apps/import/import_rig.hpp"
#include "core/packet.hpp"
#include "drivers/ros/ros_datagrams.hpp"
#include "drivers/ros/ros_pose.hpp"
#include "rosbag/bag.hpp"
#include "storage/journal_writer.hpp"

namespace hueline::apps {

/// Writes packets in the order of their times: those of one driver come later than others, because it collects them.
/// Memory is bounded.
/// Thread safety: none.
class OrderedJournal {
 public:
  explicit OrderedJournal(storage::JournalWriter writer) : writer_(std::move(writer)) {}

  /// Returns an error of the disk.
  Status add(SensorId sensor, UnixTime received, Buffer bytes);
  Status close();
  std::uint64_t packets() const { return written_; }

 private:
  struct Waiting {
    std::pair<HostTime, std::uint64_t> key;
    Packet packet;
    bool operator<(const Waiting& other) const { return key > other.key; }  // the smallest is on top
  };
  Status write();

  storage::JournalWriter writer_;
  std::priority_queue<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::uint64_t next_ = 0, written_ = 0;
  HostTime newest_{};
};

/// Makes packets of messages.
/// Thread safety: none.
class Transcriber {
 public:
  /// The sensors' numbers are their places in the list, from 1.
  Transcriber(const std::vector<ImportedSensor>& sensors, const PoseChoice& pose, drivers::RosWorld world,
              OrderedJournal& journal);

  /// Returns an error of the disk.
  Status take(const rosbag::BagTopic& topic, const rosbag::BagMessage& message);
  /// Writes what still waits for other messages. Call it after the last one. Returns an error of the disk.
  Status finish();

  /// Returns what is to be told of a topic besides `unread`: messages of poses that no pose was made of. Empty:
  /// nothing.
  std::string dropped_of(const rosbag::BagTopic& topic) const;
  /// How many poses were made; of Oem7RawMsg the logs.
  std::uint64_t poses() const { return poses_; }
  const drivers::RosCourse& course() const { return pose_.course(); }

  std::map<std::string, std::uint64_t> unread;  ///< messages that could not be used, by topic

 private:
  bool is_pose(const rosbag::BagTopic& topic) const;
  UnixTime recorded(const rosbag::BagMessage& message) const;
  Status take_pose(const rosbag::BagTopic& topic, const rosbag::BagMessage& message);
  Status write_logs();
  Status take_cloud(SensorId id, const rosbag::BagTopic& topic, const rosbag::BagMessage& message);
  Status take_image(SensorId id, const rosbag::BagTopic& topic, const rosbag::BagMessage& message);
  Status take_datagrams(SensorId id, const rosbag::BagTopic& topic, const rosbag::BagMessage& message);

  const std::vector<ImportedSensor>& sensors_;
  PoseChoice from_;
  drivers::RosPose pose_;
  OrderedJournal& journal_;
  SensorId pos_ = kSystemSensor;
  std::map<std::string, SensorId> ids_;
  std::map<SensorId, Buffer> descriptions_;
  std::map<SensorId, std::uint32_t> images_;
  std::vector<drivers::RosDatagram> datagrams_;
  std::vector<drivers::RosPose::Logs> logs_;
  std::uint64_t poses_ = 0;
};

}  // namespace hueline::apps
