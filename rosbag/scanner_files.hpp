#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "rosbag/bag.hpp"

namespace hueline::rosbag {

/// A topic of a recording, and what became of its messages.
struct TopicCount {
  BagTopic topic;
  std::string name;  ///< of its files, without an ending: the topic's as plain_name(), and different from all others
  std::uint64_t messages = 0, bytes = 0;
  std::uint64_t broken = 0;    ///< messages that do not have the form of their type
  std::uint64_t packets = 0;   ///< datagrams in them that were written
  std::uint64_t refused = 0;   ///< datagrams that a capture file cannot hold
  std::filesystem::path file;  ///< the file that was written of it; empty: none
};

/// The files of write_scanner_files().
struct ScannerFiles {
  std::vector<TopicCount> topics;  ///< all topics of the recording, used or not
  std::uint64_t damages = 0;       ///< damaged parts of the recording that were skipped
  std::string first_damage;
  Status end;  ///< why the recording could not be read to its end
};

/// Writes the datagrams of each topic that carries some (drivers/ros/ros_datagrams.hpp) as a capture file into
/// `folder`, under the topic's name, and beside them the metadata of Ouster scanners. A datagram's time is that of its
/// own stamp; without one, that of the recorder. `most_packets` limits each file; all messages are counted. Errors:
/// those of open_bag(), and Io if a file cannot be written.
Result<ScannerFiles> write_scanner_files(const std::filesystem::path& bag, const std::filesystem::path& folder,
                                         std::uint64_t most_packets = std::numeric_limits<std::uint64_t>::max());

/// Returns a topic's name as part of a file's name or a sensor's: small letters, digits and _.
std::string plain_name(const std::string& topic);

}  // namespace hueline::rosbag
