#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "core/buffer.hpp"
#include "core/result.hpp"
#include "drivers/ros/ros_message.hpp"
#include "storage/mcap_format.hpp"

/// Messages in Foxglove's public schemas: foxglove.PointCloud and others, as programs without ROS write them in MCAP,
/// and those of ROS's package foxglove_msgs.
namespace hueline::rosbag {

/// Turns the messages of a channel into the messages of ROS that say the same, in the encoding of ROS 1:
/// | schema of Foxglove | message of ROS |
/// |---|---|
/// | PointCloud | sensor_msgs/PointCloud2; a pose of the cloud in its frame is applied to the points |
/// | LaserScan | sensor_msgs/PointCloud2, of its ranges, likewise |
/// | CompressedImage, RawImage, CompressedVideo | those of foxglove_msgs |
/// | CameraCalibration | sensor_msgs/CameraInfo |
/// | FrameTransform, FrameTransforms | tf2_msgs/TFMessage |
/// | PoseInFrame | geometry_msgs/PoseStamped |
/// | PosesInFrame | geometry_msgs/PoseArray |
/// | Odometry | nav_msgs/Odometry |
/// | LocationFix | sensor_msgs/NavSatFix |
/// Fields of protobuf and JSON are found by their names in the schema of the recording, so a later version of it may
/// number them otherwise; those of flatbuffers and of foxglove_msgs by their order.
/// Thread safety: none.
class FoxgloveReader {
 public:
  virtual ~FoxgloveReader() = default;
  /// `message_encoding`: that of the channel, "protobuf", "json" or "flatbuffer". Errors: Unsupported for other
  /// encodings, a schema that is not in the table, and a protobuf schema that does not describe the message.
  static Result<std::unique_ptr<FoxgloveReader>> make(const storage::McapSchema& schema,
                                                      const std::string& message_encoding);
  /// Returns the reader of a type of foxglove_msgs, as ros_type(); null if it is none, or one that is read as it is
  /// (images).
  static std::unique_ptr<FoxgloveReader> of_ros(const std::string& type, drivers::RosEncoding encoding);
  /// The type of the messages of ROS, as ros_type().
  virtual const std::string& type() const = 0;
  /// Errors: Malformed for a message that does not have the form of its schema.
  virtual Result<Buffer> turned(std::span<const std::byte> message) const = 0;
};

}  // namespace hueline::rosbag
