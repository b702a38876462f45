#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "core/result.hpp"
#include "core/time.hpp"
#include "drivers/ros/ros_message.hpp"

/// Recordings that programs of the Robot Operating System (ROS) made.
namespace hueline::rosbag {

/// One stream of messages of a recording.
struct BagTopic {
  std::string name;  ///< "/velodyne_packets"
  std::string type;  ///< without ROS 2's "msg": "velodyne_msgs/VelodyneScan"
  drivers::RosEncoding encoding = drivers::RosEncoding::Cdr;
  /// Why its messages cannot be read, in words; empty: they can. Such a topic's messages are returned all the same.
  std::string trouble;
  /// The type of the messages in the recording, where the reader gives them as messages of ROS: "foxglove.PointCloud".
  std::string written_type{};
  bool operator==(const BagTopic&) const = default;
};

/// A message as it lies in the recording.
struct BagMessage {
  std::size_t topic = 0;  ///< index in Bag::topics()
  UnixTime received{};    ///< when the recorder took it, by the clock of its computer
  Buffer data;
};

/// Interface of the readers of recordings, which read from front to back.
/// Thread safety: none; one thread calls all functions.
class Bag {
 public:
  virtual ~Bag() = default;
  /// Returns the topics that were found so far. Their order stays, and new ones come behind them.
  virtual const std::vector<BagTopic>& topics() const = 0;
  /// Returns the next message in the order of the file. Errors:
  /// - EndOfData: everything is read.
  /// - Truncated, Io, Unsupported: nothing more can be read; all whole messages were returned before. Later calls
  /// repeat
  ///   it.
  /// - Malformed: something is damaged and was skipped. Call again to continue.
  virtual Result<BagMessage> next() = 0;
};

/// Opens a recording: MCAP, SQLite (.db3, both of ROS 2's rosbag2), ROS 1's .bag (version 2.0), or a folder with the
/// files of one recording, which are read in the order of their names and numbers. Chunks and messages may be
/// compressed (zstd, lz4, bz2). Errors: those of InputFile; Unsupported if it is none of these, with the reason;
/// Malformed, Truncated.
Result<std::unique_ptr<Bag>> open_bag(const std::filesystem::path& path);

/// BagTopic::trouble of what hueline itself has written.
inline constexpr const char* kIsOfDrive = "it is of a drive of hueline, which `hueline replay` reads";
inline constexpr const char* kIsOfView = "it is of a view of hueline, which shows a drive";

/// Returns whether `path` looks like a recording that open_bag() reads and that is not one of hueline's own. An MCAP
/// file of another program is a recording whatever its messages are, if it describes a channel: who reads it says of
/// each topic why it is not used.
bool is_bag(const std::filesystem::path& path);

/// The topics of a reader that meets them one by one. The number of topics is limited, because each takes memory.
class TopicList {
 public:
  static constexpr std::size_t kMost = 65536;
  /// Adds a topic, or finds it. Returns its index; nothing beyond kMost.
  std::optional<std::size_t> add(BagTopic topic);
  const std::vector<BagTopic>& all() const { return all_; }

 private:
  std::vector<BagTopic> all_;
  std::map<std::pair<std::string, std::string>, std::size_t> known_;
};

// The readers of each format, for open_bag(). Errors as there.
Result<std::unique_ptr<Bag>> open_mcap_bag(const std::filesystem::path& path);
Result<std::unique_ptr<Bag>> open_sqlite_bag(const std::filesystem::path& path);
Result<std::unique_ptr<Bag>> open_ros1_bag(const std::filesystem::path& path);

}  // namespace hueline::rosbag
