#include "drivers/v4l2/v4l2_packet.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include "drivers/little_endian.hpp"

namespace hueline::drivers {
bool V4l2Header::is_damaged() const { return (flags & V4L2_BUF_FLAG_ERROR) != 0; }
bool V4l2Header::is_monotonic() const {
  return (flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
}
bool V4l2Header::is_exposure_start() const {
  return (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
}

void encode_v4l2_header(const V4l2Header& header, std::span<std::byte, kV4l2HeaderSize> out) {
  put_little(out, 0, kV4l2Magic);
  put_little(out, 4, kV4l2Version);
  put_little(out, 6, static_cast<std::uint16_t>(kV4l2HeaderSize));
  put_little(out, 8, header.width);
  put_little(out, 12, header.height);
  put_little(out, 16, header.stride);
  put_little(out, 20, header.fourcc);
  put_little(out, 24, header.sequence);
  put_little(out, 28, header.flags);
  put_little(out, 32, static_cast<std::uint64_t>(header.stamp.count()));
  put_little(out, 40, header.used_bytes);
  put_little(out, 44, header.colour_space);
  put_little(out, 48, header.ycbcr_encoding);
  put_little(out, 52, header.quantisation);
  put_little(out, 56, std::uint64_t{0});
}

Result<V4l2Header> decode_v4l2_header(std::span<const std::byte> packet) {
  if (packet.size() < kV4l2HeaderSize)
    return Error{ErrorCode::Truncated,
                 fmt::format("V4L2 packet of {} bytes; the header alone has {}", packet.size(), kV4l2HeaderSize)};
  if (const auto magic = get_little<std::uint32_t>(packet, 0); magic != kV4l2Magic)
    return Error{ErrorCode::Malformed,
                 fmt::format("V4L2 packet begins with 0x{:08x}, not with 0x{:08x}", magic, kV4l2Magic)};
  if (const auto version = get_little<std::uint16_t>(packet, 4); version != kV4l2Version)
    return Error{ErrorCode::Unsupported,
                 fmt::format("V4L2 packet of version {}; version {} is read", version, kV4l2Version)};
  if (const auto size = get_little<std::uint16_t>(packet, 6); size != kV4l2HeaderSize)
    return Error{ErrorCode::Malformed,
                 fmt::format("V4L2 packet with a header of {} bytes, not {}", size, kV4l2HeaderSize)};
  V4l2Header header{
      .width = get_little<std::uint32_t>(packet, 8),
      .height = get_little<std::uint32_t>(packet, 12),
      .stride = get_little<std::uint32_t>(packet, 16),
      .fourcc = get_little<std::uint32_t>(packet, 20),
      .sequence = get_little<std::uint32_t>(packet, 24),
      .flags = get_little<std::uint32_t>(packet, 28),
      .stamp = nanoseconds(static_cast<std::int64_t>(get_little<std::uint64_t>(packet, 32))),
      .used_bytes = get_little<std::uint32_t>(packet, 40),
      .colour_space = get_little<std::uint32_t>(packet, 44),
      .ycbcr_encoding = get_little<std::uint32_t>(packet, 48),
      .quantisation = get_little<std::uint32_t>(packet, 52),
  };
  const std::size_t came = packet.size() - kV4l2HeaderSize;
  if (came != header.used_bytes)
    return Error{came < header.used_bytes ? ErrorCode::Truncated : ErrorCode::Malformed,
                 fmt::format("V4L2 packet with {} bytes of image {}; its header says {}", came, header.sequence,
                             header.used_bytes)};
  return header;
}

}  // namespace hueline::drivers
