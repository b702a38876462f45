#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/measurements.hpp"
#include "core/result.hpp"

/// What an image packet holds: a header of 64 bytes, then the pixels as the camera sent them, in one buffer.
///
///   offset  size  little endian
///        0     4  magic 0x31474D49, the characters "IMG1"
///        4     2  version, 1
///        6     2  size of the header, 64: where the pixels begin
///        8     4  width, pixels
///       12     4  height, pixels
///       16     4  stride, bytes from row to row
///       20     4  pixel format, the code of the GenICam Pixel Format Naming Convention (PFNC 2.x)
///       24     8  frame id, the camera's own number (GigE Vision 1.x: 16 bits, 0 is skipped; 2.x and USB3 Vision: 64
///       bits) 32     8  camera timestamp, signed ns on the camera's counter; 0 if the camera does not stamp 40     4
///       status, ImageStatus 44     4  missing packets 48     4  left edge of the region on the sensor, pixels 52     4
///       top edge 56     8  0
/// Pixels follow: stride * height bytes. Where packets are missing they hold whatever the buffer held before.
namespace hueline::drivers {

constexpr std::uint32_t kImageMagic = 0x31474D49;
constexpr std::uint16_t kImageVersion = 1;
constexpr std::size_t kImageHeaderSize = 64;

enum class ImageStatus : std::uint32_t {
  Complete = 0,
  MissingPackets = 1,  ///< the next image came before this one was whole
  TimedOut = 2,        ///< packets stopped coming
  Broken = 3,          ///< does not fit its buffer, or packet numbers make no sense
  NoLeader = 4,        ///< the packet that describes the image is missing: frame id, timestamp and region are not known
};
const char* name(ImageStatus status);

struct ImageHeader {
  std::uint32_t width = 0, height = 0, stride = 0;
  std::uint32_t pfnc = 0;  ///< pixel format code
  std::uint64_t frame_id = 0;
  DeviceTime<CameraCounter> time{};
  ImageStatus status = ImageStatus::Complete;
  std::uint32_t missing_packets = 0;
  std::uint32_t offset_x = 0, offset_y = 0;

  std::uint64_t pixel_bytes() const { return std::uint64_t{stride} * height; }
};

/// PFNC codes of the formats that we read.
std::uint32_t pfnc_code(PixelFormat format);
std::optional<PixelFormat> pixel_format_of(std::uint32_t pfnc);
std::uint32_t bytes_per_pixel(PixelFormat format);

/// Writes the 64 bytes at `out`.
void encode_image_header(const ImageHeader& header, std::span<std::byte, kImageHeaderSize> out);
/// Of a whole packet or of its first 64 bytes; does not look at the pixels. Truncated: fewer bytes. Malformed: magic,
/// header size, status or a stride that does not hold a row. Unsupported: another version.
Result<ImageHeader> decode_image_header(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
