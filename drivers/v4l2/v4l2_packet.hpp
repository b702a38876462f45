#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"
#include "core/time.hpp"

/// The layout of a packet of a V4L2 camera: a header of 64 bytes with what the kernel says of one buffer, then the
/// buffer's used bytes as the driver filled them. Numbers with names of the kernel have its values
/// (linux/videodev2.h). Little endian:
///
///   offset  size  field
///        0     4  magic 0x314C3456, the characters "V4L1"
///        4     2  version, 1
///        6     2  size of the header, bytes, 64: the image begins here
///        8     4  width, pixels
///       12     4  height, pixels
///       16     4  bytes from one row to the next, 0 for a compressed image
///       20     4  pixel format (V4L2_PIX_FMT_*)
///       24     4  sequence, the driver's count of images; a gap means lost images
///       28     4  flags of the buffer (V4L2_BUF_FLAG_*)
///       32     8  the buffer's stamp, ns, signed; `flags` name its clock and the event
///       40     4  used bytes of the buffer, which follow the header
///       44     4  colour space (V4L2_COLORSPACE_*)
///       48     4  encoding of the colour differences (V4L2_YCBCR_ENC_*)
///       52     4  quantisation (V4L2_QUANTIZATION_*)
///       56     8  reserved, 0
namespace hueline::drivers {

constexpr std::uint32_t kV4l2Magic = 0x314C3456;
constexpr std::uint16_t kV4l2Version = 1;
constexpr std::size_t kV4l2HeaderSize = 64;

/// The fields of the header.
struct V4l2Header {
  std::uint32_t width = 0, height = 0, stride = 0;
  std::uint32_t fourcc = 0;  ///< pixel format
  std::uint32_t sequence = 0;
  std::uint32_t flags = 0;
  nanoseconds stamp{0};
  std::uint32_t used_bytes = 0;
  std::uint32_t colour_space = 0, ycbcr_encoding = 0, quantisation = 0;

  /// Returns whether the driver says that the buffer's content is damaged.
  bool is_damaged() const;
  /// Returns whether the stamp is of CLOCK_MONOTONIC. The kernel knows no other clock for cameras; without it, the
  /// clock is unknown.
  bool is_monotonic() const;
  /// Returns whether the stamp names the start of the exposure. Otherwise it names the end of the image: its last byte
  /// (or that of its first packet, with some USB drivers) had come.
  bool is_exposure_start() const;
};

/// Writes the 64 bytes of the header to `out`.
void encode_v4l2_header(const V4l2Header& header, std::span<std::byte, kV4l2HeaderSize> out);
/// Reads the header of a whole packet. Errors: Truncated (the packet is shorter than header and used bytes), Malformed
/// (the magic, the size of the header, or more bytes than used), Unsupported (another version).
Result<V4l2Header> decode_v4l2_header(std::span<const std::byte> packet);

}  // namespace hueline::drivers
