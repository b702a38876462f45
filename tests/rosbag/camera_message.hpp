#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/rosbag/sample_bag.hpp"

namespace hueline::test {

/// What a sensor_msgs/CameraInfo says; the numbers are those of an image of 160 x 120 px.
struct CameraInfo {
  std::string frame = "camera";
  std::uint32_t width = 160, height = 120;
  std::string model = "plumb_bob";
  std::vector<double> distortion{};
  double fx = 80, fy = 81, cx = 79.5, cy = 60;
  std::array<double, 12> P{};
  std::array<double, 9> R{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::uint32_t binning = 0, part_x = 0, part_y = 0, part_width = 0, part_height = 0;
};

inline RosWriter camera_info(drivers::RosEncoding encoding, std::int64_t ns, const CameraInfo& info) {
  RosWriter out(encoding);
  out.header(ns, info.frame).put(info.height).put(info.width).text(info.model);
  out.put(static_cast<std::uint32_t>(info.distortion.size()));
  for (const double value : info.distortion) out.put(value);
  for (const double value : {info.fx, 0.0, info.cx, 0.0, info.fy, info.cy, 0.0, 0.0, 1.0}) out.put(value);
  for (const double value : info.R) out.put(value);
  for (const double value : info.P) out.put(value);
  out.put(info.binning).put(info.binning).put(info.part_x).put(info.part_y);
  return out.put(info.part_height).put(info.part_width).put(std::uint8_t{0});
}

}  // namespace hueline::test
