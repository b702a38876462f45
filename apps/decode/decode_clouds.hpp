#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "apps/decode/decode_capture.hpp"

namespace hueline::apps {

/// Reads the point clouds in a recording of ROS (drivers/ros/ros_cloud.hpp). `files` are the files to write by topic.
/// Each topic is read as its first cloud with points suggests (RosCloudDecoder::suited). A scanner's address is its
/// topic. `unused` gets the topics without a point, with the reason. Errors: those of rosbag::open_bag().
Result<DecodedCapture> decode_clouds(const DecodeOptions& options,
                                     const std::map<std::string, std::filesystem::path>& files,
                                     std::map<std::string, std::string>& unused);

}  // namespace hueline::apps
