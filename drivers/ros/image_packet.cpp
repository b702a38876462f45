#include "drivers/ros/image_packet.hpp"

#include <cstring>
#include <limits>
#include <utility>

#include "drivers/v4l2/motion_jpeg.hpp"
#include "drivers/v4l2/v4l2_packet.hpp"
#include "drivers/v4l2/v4l2_pixels.hpp"

namespace hueline::drivers {
namespace {

// Numbers of the kernel (linux/videodev2.h): the stamp is of the monotonic clock and of the exposure's start.
constexpr std::uint32_t kMonotonic = 0x2000, kStartOfExposure = 0x10000;

std::uint32_t code_of(std::string_view fourcc) {
  std::uint32_t code = 0;
  std::memcpy(&code, fourcc.data(), sizeof code);
  return code;
}

}  // namespace

PixelLayout layout_of(std::string_view fourcc, const PacketImage& image) {
  const V4l2Format& format = *find_v4l2_format(code_of(fourcc));
  return {format.row_bytes(image.width), format.image_bytes(image.width, image.height, image.stride),
          format.packing == V4l2Packing::Words};
}

Buffer image_packet(std::string_view fourcc, const PacketImage& image, std::span<const std::byte> pixels) {
  V4l2Header head;
  head.sequence = image.sequence;
  head.width = image.width;
  head.height = image.height;
  head.stride = image.stride;
  head.fourcc = code_of(fourcc);
  head.flags = kMonotonic | kStartOfExposure;
  head.stamp = image.stamp.time_since_epoch();
  head.used_bytes = static_cast<std::uint32_t>(pixels.size());
  MutableBuffer packet =
      BufferPool(std::numeric_limits<std::size_t>::max() / 2).acquire(kV4l2HeaderSize + pixels.size());
  encode_v4l2_header(head, packet.bytes().first<kV4l2HeaderSize>());
  if (!pixels.empty()) std::memcpy(packet.data() + kV4l2HeaderSize, pixels.data(), pixels.size());
  return std::move(packet).share();
}

std::string format_word(std::string_view fourcc) { return fourcc_text(code_of(fourcc)); }

JpegHead jpeg_head(std::span<const std::byte> jpeg) {
  MotionJpegDecoder::Head head = MotionJpegDecoder().read_head(jpeg);
  return {head.width, head.height, head.format == PixelFormat::Mono8, std::move(head.why)};
}

}  // namespace hueline::drivers
