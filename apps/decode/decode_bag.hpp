#pragma once

#include <map>
#include <string>
#include <vector>

#include "apps/decode/decode_capture.hpp"
#include "rosbag/scanner_files.hpp"

namespace hueline::apps {

/// What a recording of ROS gave.
struct DecodedBag {
  rosbag::ScannerFiles read;
  DecodedCapture decoded;                     ///< of all topics; a scanner's address is its topic
  std::map<std::string, std::string> unused;  ///< why a topic with datagrams gave no points, by the topic's name
};

/// Makes clouds of the laser scanners whose datagrams or point clouds a recording of ROS holds (rosbag/bag.hpp), each
/// in the scanner's own frame. The datagrams go through capture files in a folder beside `options.out`, which is
/// removed at the end. With one scanner the cloud is `out`; with several, each cloud has its topic in its name. Errors:
/// those of rosbag::open_bag(), and Io if the files cannot be written.
Result<DecodedBag> decode_bag(const DecodeOptions& options);

/// Returns a table of the topics for people, with what each became: one line each. `used` says it of a topic.
std::string topic_table(const std::vector<rosbag::TopicCount>& topics, const std::map<std::string, std::string>& used);

}  // namespace hueline::apps
