#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "rosbag/ros1_record.hpp"

namespace hueline::rosbag {

/// What stands at the end of a recording of ROS 1: where its chunks are. A reader from front to back needs it only
/// where a record is damaged.
struct Ros1Index {
  std::map<std::uint64_t, std::uint64_t> chunks;  ///< how many messages the index says are in each, by its first byte
  std::vector<std::pair<Ros1Header, std::string>> connections;  ///< each record's header and data
};

/// Reads the index that begins at byte `at`. What is not whole is left out: of a recording that was cut off, all.
Ros1Index read_ros1_index(InputFile& file, std::uint64_t at);

}  // namespace hueline::rosbag
