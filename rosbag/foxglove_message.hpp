#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "core/buffer.hpp"
#include "core/result.hpp"
#include "storage/mcap_format.hpp"

/// Messages in Foxglove's public schemas (foxglove.PointCloud and others), as programs without ROS write them in MCAP.
namespace hueline::rosbag {

/// Turns the messages of a channel into the messages of ROS that say the same, in the encoding of ROS 1:
/// | schema of Foxglove | message of ROS |
/// |---|---|
/// | PointCloud | sensor_msgs/PointCloud2; a pose of the cloud in its frame is applied to the points |
/// | CompressedImage, RawImage, CompressedVideo | those of foxglove_msgs |
/// | CameraCalibration | sensor_msgs/CameraInfo |
/// | FrameTransform, FrameTransforms | tf2_msgs/TFMessage |
/// | PoseInFrame | geometry_msgs/PoseStamped |
/// | LocationFix | sensor_msgs/NavSatFix |
/// Fields are found by their names in the schema of the recording, so a later version of it may number them otherwise.
/// Thread safety: none.
class FoxgloveReader {
 public:
  virtual ~FoxgloveReader() = default;
  /// `message_encoding`: that of the channel, "protobuf" or "json". Errors: Unsupported for other encodings, a schema
  /// that is not in the table, and a protobuf schema that does not describe the message.
  static Result<std::unique_ptr<FoxgloveReader>> make(const storage::McapSchema& schema,
                                                      const std::string& message_encoding);
  /// The type of the messages of ROS, as ros_type().
  virtual const std::string& type() const = 0;
  /// Errors: Malformed for a message that does not have the form of its schema.
  virtual Result<Buffer> turned(std::span<const std::byte> message) const = 0;
};

}  // namespace hueline::rosbag
