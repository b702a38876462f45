#include "drivers/ros/ros_image.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "drivers/v4l2/motion_jpeg.hpp"
#include "drivers/v4l2/v4l2_packet.hpp"
#include "drivers/v4l2/v4l2_pixels.hpp"

namespace hueline::drivers {
namespace {

// Numbers of the kernel (linux/videodev2.h): the stamp is of the monotonic clock and of the exposure's start.
constexpr std::uint32_t kMonotonic = 0x2000, kStartOfExposure = 0x10000;

/// What sensor_msgs/image_encodings calls a pixel format, and V4L2's four characters for it.
struct Encoding {
  std::string_view ros, fourcc;
  std::uint32_t bytes_per_pixel;
};
constexpr std::array<Encoding, 10> kEncodings{{{"mono8", "GREY", 1},
                                               {"8UC1", "GREY", 1},
                                               {"rgb8", "RGB3", 3},
                                               {"bgr8", "BGR3", 3},
                                               {"bayer_rggb8", "RGGB", 1},
                                               {"bayer_bggr8", "BA81", 1},
                                               {"bayer_gbrg8", "GBRG", 1},
                                               {"bayer_grbg8", "GRBG", 1},
                                               {"yuv422", "UYVY", 2},
                                               {"yuv422_yuy2", "YUYV", 2}}};

std::uint32_t code_of(std::string_view fourcc) {
  std::uint32_t code = 0;
  std::memcpy(&code, fourcc.data(), sizeof code);
  return code;
}

RosImage packed(RosHeader header, std::string_view format, V4l2Header v4l2, std::span<const std::byte> pixels) {
  RosImage out;
  v4l2.fourcc = code_of(format);
  v4l2.flags = kMonotonic | kStartOfExposure;
  v4l2.stamp = header.stamp.time_since_epoch();
  v4l2.used_bytes = static_cast<std::uint32_t>(pixels.size());
  MutableBuffer packet =
      BufferPool(std::numeric_limits<std::size_t>::max() / 2).acquire(kV4l2HeaderSize + pixels.size());
  encode_v4l2_header(v4l2, packet.bytes().first<kV4l2HeaderSize>());
  if (!pixels.empty()) std::memcpy(packet.data() + kV4l2HeaderSize, pixels.data(), pixels.size());
  out.header = std::move(header);
  out.format = format;
  out.width = v4l2.width;
  out.height = v4l2.height;
  out.packet = std::move(packet).share();
  return out;
}

Error broken() { return {ErrorCode::Malformed, "an image whose size contradicts its bytes"}; }

}  // namespace

bool carries_image(std::string_view type) {
  return type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage";
}

Result<RosImage> take_image(std::string_view type, RosReader message, std::uint32_t sequence) {
  RosHeader header = message.take_header();
  V4l2Header v4l2;
  v4l2.sequence = sequence;
  if (type == "sensor_msgs/CompressedImage") {
    const std::string format = message.take_string();
    const auto bytes = message.take_byte_sequence();
    if (!message.ok()) return broken();
    const auto head = MotionJpegDecoder().read_head(bytes);
    if (!head.why.empty())
      return Error{ErrorCode::Unsupported, "compressed as \"" + format + "\", no JPEG that is read: " + head.why};
    v4l2.width = head.width;
    v4l2.height = head.height;
    return packed(std::move(header), "MJPG", v4l2, bytes);
  }
  v4l2.height = message.take<std::uint32_t>();
  v4l2.width = message.take<std::uint32_t>();
  const std::string encoding = message.take_string();
  message.take<std::uint8_t>();  // byte order, which single bytes do not have
  v4l2.stride = message.take<std::uint32_t>();
  const auto bytes = message.take_byte_sequence();
  const auto* found = std::ranges::find(kEncodings, encoding, &Encoding::ros);
  if (!message.ok()) return broken();
  if (found == kEncodings.end()) return Error{ErrorCode::Unsupported, "pixels of the encoding \"" + encoding + "\""};
  const std::uint64_t row = std::uint64_t{v4l2.width} * found->bytes_per_pixel;
  const bool is_sound = v4l2.width > 0 && v4l2.height > 0 && v4l2.width <= 65535 && v4l2.height <= 65535 &&
                        row <= v4l2.stride && std::uint64_t{v4l2.stride} * v4l2.height <= bytes.size();
  if (!is_sound) return broken();
  return packed(std::move(header), found->fourcc, v4l2, bytes);
}

}  // namespace hueline::drivers
