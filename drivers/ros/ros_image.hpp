#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/buffer.hpp"
#include "core/result.hpp"
#include "drivers/ros/ros_message.hpp"

/// Images in messages of ROS, as the packets of a V4L2 camera: the same pixels behind another head.
namespace hueline::drivers {

/// Returns whether messages of this type (ros_type()) are images: sensor_msgs/Image and CompressedImage.
bool carries_image(std::string_view type);

/// The image of a message.
struct RosImage {
  RosHeader header;
  std::string format;  ///< the value of a V4L2 camera's key `format`
  std::uint32_t width = 0, height = 0;
  Buffer packet;  ///< a packet for V4l2Decoder; its stamp is the message's, ns since 1970, as the exposure's start
};

/// Reads an image; `sequence` is its number. Pixels that are read: mono8, rgb8, bgr8, bayer_*8, yuv422 and yuv422_yuy2,
/// and JPEG. Errors: Malformed for a message that contradicts itself, Unsupported for other pixels, with their name.
Result<RosImage> take_image(std::string_view type, RosReader message, std::uint32_t sequence);

}  // namespace hueline::drivers
