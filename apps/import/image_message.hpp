#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/buffer.hpp"
#include "core/result.hpp"
#include "drivers/ros/ros_message.hpp"

/// Images in messages of ROS, as the packets of a V4L2 camera: the same pixels behind another head.
namespace hueline::apps {

/// Returns whether messages of this type (ros_type()) are images: sensor_msgs/Image and CompressedImage, those of
/// foxglove_msgs, and video, which take_image() refuses with the reason.
bool carries_image(std::string_view type);

/// Reads what an image begins with: its time and its frame.
drivers::RosHeader take_image_header(std::string_view type, drivers::RosReader& message);

/// What a packet gets beside the message.
struct ImageStamp {
  std::uint32_t sequence = 0;  ///< its number
  UnixTime unstamped{};        ///< its time if the message has the stamp 0
  nanoseconds shift{0};        ///< is added to the message's stamp
  unsigned raised_bits = 0;    ///< samples of 16 bits are taken 2 to this times as large
};

/// The image of a message.
struct ImageMessage {
  drivers::RosHeader header;  ///< with the time that the packet has
  std::string format;         ///< the value of a V4L2 camera's key `format`
  std::uint32_t width = 0, height = 0;
  bool is_grey = false;
  int orientation = 1;  ///< how its EXIF data show it (core/exif_orientation.hpp); the packet has it as stored
  Buffer packet;        ///< a packet for V4l2Decoder; its stamp is header.stamp, ns since 1970, as the exposure's start
};

/// Returns how many of the 16 bits of its samples, plain or in a PNG, an image uses: 12 if all are below 4096. 0: it
/// has no such samples.
unsigned used_bits(std::string_view type, drivers::RosReader message);

/// Reads an image.
/// - mono8, mono16, 8UC1, 8UC3, rgb8, bgr8, bayer_* of 8 and 16 bits, yuv422 and yuyv in all their names, nv21 and
///   baseline JPEG are taken as they are.
/// - rgba8, bgra8 and 8UC4 lose their alpha; rgb16, bgr16, rgba16 and bgra16 are taken with their 8 highest bits,
///   because V4L2 has no such pixels.
/// - PNG, and JPEG with several scans, become red, green and blue, or grey, of the 8 highest bits.
/// Errors: Malformed for a message that contradicts itself, Unsupported for other pixels, with their name.
Result<ImageMessage> take_image(std::string_view type, drivers::RosReader message, const ImageStamp& stamp);

}  // namespace hueline::apps
