#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "drivers/ros/ros_message.hpp"

/// Point clouds in messages of ROS: what a driver has made of a scanner's packets.
namespace hueline::drivers {

/// The kinds of messages that hold the points of a scanner.
enum class RosCloudKind : std::uint8_t {
  PointCloud2,        ///< sensor_msgs/PointCloud2
  Livox,              ///< CustomMsg of livox_ros_driver and livox_ros_driver2
  LaserScan,          ///< sensor_msgs/LaserScan, the ranges of a scanner with one plane
  PackedPointCloud2,  ///< point_cloud_interfaces/CompressedPointCloud2, by point_cloud_transport
  PointCloud,         ///< sensor_msgs/PointCloud, the older kind
};
/// Returns the kind of messages of a type (ros_type()); nothing if they hold no such points.
std::optional<RosCloudKind> cloud_kind(std::string_view type);
inline bool carries_cloud(std::string_view type) { return cloud_kind(type).has_value(); }
/// Returns the type of a kind's messages; of several the newest.
const char* type_of(RosCloudKind kind);
/// Returns the word of a kind in a rig (`message: point_cloud2`).
const char* word_of(RosCloudKind kind);

/// One value that every point of a cloud has.
struct RosField {
  std::string name;
  std::uint32_t offset = 0;  ///< from the beginning of the point's bytes
  std::uint8_t type = 0;     ///< sensor_msgs/PointField: 1 to 8 are int8, uint8, int16, ... float32, float64
};
/// Returns the name of a field's type: "float32".
const char* type_name(const RosField& field);
/// Returns whether the field's values are whole numbers.
inline bool is_whole(const RosField& field) { return field.type < 7; }

/// The cloud of a message. Its points are read from the message, which must stay valid as long as this object, or are
/// unpacked, or computed from its ranges.
struct RosCloud {
  RosHeader header;
  /// To which the times of the points count, if the message says it (Livox); otherwise they count to header.stamp, or
  /// are dates.
  std::optional<UnixTime> time_base;
  std::vector<RosField> fields;
  std::size_t width = 0, height = 0;
  std::size_t point_step = 0, row_step = 0;  ///< bytes from one point, one row, to the next
  bool is_big_endian = false;
  std::span<const std::byte> data;
  std::shared_ptr<const std::vector<std::byte>> computed;  ///< holds `data` if it is not the message's

  std::size_t size() const { return width * height; }
  std::span<const std::byte> point(std::size_t i) const {
    return data.subspan((i / width) * row_step + (i % width) * point_step);
  }
  /// Returns the field of this name, or null. Fields whose type is not known, or that reach out of the point, are not
  /// in `fields`.
  const RosField* find(std::string_view name) const;
};

/// Reads the value of `field` of a point (RosCloud::point).
double value_of(const RosCloud& cloud, const RosField& field, std::span<const std::byte> point);

/// Reads the head of a message and checks that its points lie within its bytes. Errors: Malformed, with the numbers
/// that contradict each other; Unsupported for a cloud without x, y and z, and one whose compression is not read.
/// Sources: sensor_msgs/PointCloud2, PointCloud, PointField and LaserScan of ROS's common_interfaces;
/// CompressedPointCloud2 of its point_cloud_interfaces; CustomMsg of Livox's drivers.
Result<RosCloud> take_cloud(RosCloudKind kind, RosReader message);
/// The same for a message of a type that carries_cloud().
inline Result<RosCloud> take_cloud(std::string_view type, RosReader message) {
  const auto kind = cloud_kind(type);
  if (!kind) return Error{ErrorCode::Unsupported, std::string(type) + " holds no point cloud"};
  return take_cloud(*kind, std::move(message));
}

}  // namespace hueline::drivers
