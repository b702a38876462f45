#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "core/measurements.hpp"
#include "core/result.hpp"

/// The layout of an image packet: a header of 64 bytes, then the pixels as the camera sent them, in one buffer. Little
/// endian:
///
///   offset  size  field
///        0     4  magic 0x31474D49, the characters "IMG1"
///        4     2  version, 1
///        6     2  size of the header, bytes, 64: the pixels begin here
///        8     4  width, pixels
///       12     4  height, pixels
///       16     4  stride, bytes from one row to the next
///       20     4  pixel format, code of the GenICam Pixel Format Naming Convention (PFNC 2.x)
///       24     8  frame id, the camera's own number
///       32     8  camera time stamp, signed, ns of the camera's counter; 0 if the camera does not stamp
///       40     4  status, ImageStatus
///       44     4  missing packets, number
///       48     4  left edge of the region on the sensor, pixels
///       52     4  top edge of the region on the sensor, pixels
///       56     4  exposure that the camera reports with the image, ns; 0 if it reports none
///       60     4  gain that the camera reports with the image, IEEE 754 single precision, the factor of its amplifier
///       on
///                 pixel values; 0 if it reports none
///       64     -  pixels, stride * height bytes
///
/// The frame id has 16 bits and skips 0 in GigE Vision 1.x; it has 64 bits in GigE Vision 2.x and USB3 Vision. Where
/// packets are missing, the pixels are whatever the buffer held before.
namespace hueline::drivers {

constexpr std::uint32_t kImageMagic = 0x31474D49;
constexpr std::uint16_t kImageVersion = 1;
constexpr std::size_t kImageHeaderSize = 64;
/// The longest exposure that an image packet can report.
constexpr nanoseconds kLongestReported{std::numeric_limits<std::uint32_t>::max()};

/// Whether an image is complete, and if not, why. The numbers are those in the packet.
enum class ImageStatus : std::uint32_t {
  Complete = 0,
  MissingPackets = 1,  ///< the next image began before this one was whole
  TimedOut = 2,        ///< packets stopped coming
  Broken = 3,          ///< the image does not fit its buffer, or its packet numbers contradict each other
  /// The packet that describes the image is missing, so the frame id, the time stamp and the region are not known.
  NoLeader = 4,
};
const char* name(ImageStatus status);

/// The fields of the header.
struct ImageHeader {
  std::uint32_t width = 0, height = 0, stride = 0;
  std::uint32_t pfnc = 0;  ///< pixel format, PFNC code
  std::uint64_t frame_id = 0;
  DeviceTime<CameraCounter> time{};
  ImageStatus status = ImageStatus::Complete;
  std::uint32_t missing_packets = 0;
  std::uint32_t offset_x = 0, offset_y = 0;
  nanoseconds exposure{0};  ///< reported by the camera; at most kLongestReported; 0: not reported
  float gain = 0;           ///< reported by the camera, a factor; 0: not reported

  std::uint64_t pixel_bytes() const { return std::uint64_t{stride} * height; }
};

/// Convert between a pixel format and its PFNC code. pixel_format_of() returns nothing for a format that is not read.
std::uint32_t pfnc_code(PixelFormat format);
std::optional<PixelFormat> pixel_format_of(std::uint32_t pfnc);
/// Returns the size of one pixel.
std::uint32_t bytes_per_pixel(PixelFormat format);

/// Writes the 64 bytes of the header to `out`. An exposure beyond kLongestReported is written as not reported.
void encode_image_header(const ImageHeader& header, std::span<std::byte, kImageHeaderSize> out);
/// Reads the header from a whole packet or from its first 64 bytes. Does not check the pixels. Errors: Truncated (fewer
/// than 64 bytes), Malformed (the magic, the header size, the status, or a stride that is shorter than a row),
/// Unsupported (another version).
Result<ImageHeader> decode_image_header(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
