#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/rosbag/sample_bag.hpp"

/// Point clouds of ROS, written from the description of their messages without the decoder's code.
namespace hueline::test {

struct CloudField {
  std::string name;
  std::uint32_t offset;
  std::uint8_t type;  ///< of sensor_msgs/PointField
};
constexpr std::uint8_t kU8 = 2, kU16 = 4, kU32 = 6, kF32 = 7, kF64 = 8;

/// A sensor_msgs/PointCloud2.
struct CloudMessage {
  std::int64_t stamp_ns = 1'700'000'000'000'000'000;
  std::string frame = "laser";
  std::vector<CloudField> fields;
  std::uint32_t height = 1, width = 0, point_step = 0, row_step = 0;
  bool is_big_endian = false;
  std::string data;

  /// Appends a value in the byte order of the message.
  template <class T>
  CloudMessage& put(T value) {
    std::string bytes = raw_of(value);
    if (is_big_endian) bytes.assign(bytes.rbegin(), bytes.rend());
    data += bytes;
    return *this;
  }
  std::string bytes(drivers::RosEncoding encoding) const {
    RosWriter out(encoding);
    out.header(stamp_ns, frame).put(height).put(width).put(static_cast<std::uint32_t>(fields.size()));
    for (const CloudField& field : fields) out.text(field.name).put(field.offset).put(field.type).put(std::uint32_t{1});
    out.put(std::uint8_t{is_big_endian}).put(point_step).put(row_step).sequence(data).put(std::uint8_t{0});
    return out.bytes();
  }
};

/// Turns of a scanner as velodyne_pointcloud writes them: x, y, z, intensity, ring, time after header.stamp.
inline CloudMessage velodyne_turn(std::int64_t stamp_ns, int points, double seconds) {
  CloudMessage out;
  out.stamp_ns = stamp_ns;
  out.fields = {{"x", 0, kF32},          {"y", 4, kF32},     {"z", 8, kF32},
                {"intensity", 12, kF32}, {"ring", 16, kU16}, {"time", 18, kF32}};
  out.point_step = 22;
  out.width = static_cast<std::uint32_t>(points);
  out.row_step = out.width * out.point_step;
  for (int i = 0; i < points; ++i) {
    out.put(10.0f + static_cast<float>(i)).put(-5.0f).put(0.5f).put(static_cast<float>(i % 256));
    out.put(static_cast<std::uint16_t>(i % 16)).put(static_cast<float>(seconds * i / (points - 1)));
  }
  return out;
}

}  // namespace hueline::test
