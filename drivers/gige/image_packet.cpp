#include "drivers/gige/image_packet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "drivers/little_endian.hpp"

namespace hueline::drivers {

namespace {

struct Format {
  PixelFormat format;
  std::uint32_t pfnc, bytes;
};
// The 8-bit formats of GenICam PFNC 2.4.
constexpr std::array kFormats{
    Format{PixelFormat::Mono8, 0x01080001, 1},    Format{PixelFormat::BayerGR8, 0x01080008, 1},
    Format{PixelFormat::BayerRG8, 0x01080009, 1}, Format{PixelFormat::BayerGB8, 0x0108000A, 1},
    Format{PixelFormat::BayerBG8, 0x0108000B, 1}, Format{PixelFormat::Rgb8, 0x02180014, 3},
};
const Format& entry(PixelFormat format) {
  const auto* found = std::ranges::find(kFormats, format, &Format::format);
  return found == kFormats.end() ? kFormats.front() : *found;
}

}  // namespace

const char* name(ImageStatus status) {
  switch (status) {
    case ImageStatus::Complete:
      return "Complete";
    case ImageStatus::MissingPackets:
      return "MissingPackets";
    case ImageStatus::TimedOut:
      return "TimedOut";
    case ImageStatus::Broken:
      return "Broken";
    case ImageStatus::NoLeader:
      return "NoLeader";
  }
  return "?";
}

std::uint32_t pfnc_code(PixelFormat format) { return entry(format).pfnc; }
std::uint32_t bytes_per_pixel(PixelFormat format) { return entry(format).bytes; }
std::optional<PixelFormat> pixel_format_of(std::uint32_t pfnc) {
  const auto* found = std::ranges::find(kFormats, pfnc, &Format::pfnc);
  if (found == kFormats.end()) return std::nullopt;
  return found->format;
}

void encode_image_header(const ImageHeader& header, std::span<std::byte, kImageHeaderSize> out) {
  put_little(out, 0, kImageMagic);
  put_little(out, 4, kImageVersion);
  put_little(out, 6, static_cast<std::uint16_t>(kImageHeaderSize));
  put_little(out, 8, header.width);
  put_little(out, 12, header.height);
  put_little(out, 16, header.stride);
  put_little(out, 20, header.pfnc);
  put_little(out, 24, header.frame_id);
  put_little(out, 32, static_cast<std::uint64_t>(count_ns(header.time)));
  put_little(out, 40, static_cast<std::uint32_t>(header.status));
  put_little(out, 44, header.missing_packets);
  put_little(out, 48, header.offset_x);
  put_little(out, 52, header.offset_y);
  const bool is_told = header.exposure > nanoseconds(0) && header.exposure <= kLongestReported;
  put_little(out, 56, is_told ? static_cast<std::uint32_t>(header.exposure.count()) : 0U);
  put_little(out, 60, std::bit_cast<std::uint32_t>(header.gain));
}

Result<ImageHeader> decode_image_header(std::span<const std::byte> bytes) {
  if (bytes.size() < kImageHeaderSize)
    return Error{ErrorCode::Truncated,
                 fmt::format("image packet of {} bytes; the header alone has {}", bytes.size(), kImageHeaderSize)};
  if (const auto magic = get_little<std::uint32_t>(bytes, 0); magic != kImageMagic)
    return Error{ErrorCode::Malformed,
                 fmt::format("image packet begins with 0x{:08x}, not with 0x{:08x}", magic, kImageMagic)};
  if (const auto version = get_little<std::uint16_t>(bytes, 4); version != kImageVersion)
    return Error{ErrorCode::Unsupported,
                 fmt::format("image packet of version {}; version {} is read", version, kImageVersion)};
  if (const auto size = get_little<std::uint16_t>(bytes, 6); size != kImageHeaderSize)
    return Error{ErrorCode::Malformed,
                 fmt::format("image packet with a header of {} bytes, not {}", size, kImageHeaderSize)};
  const auto status = get_little<std::uint32_t>(bytes, 40);
  if (status > static_cast<std::uint32_t>(ImageStatus::NoLeader))
    return Error{ErrorCode::Malformed, fmt::format("image packet with status {}", status)};
  ImageHeader header{
      .width = get_little<std::uint32_t>(bytes, 8),
      .height = get_little<std::uint32_t>(bytes, 12),
      .stride = get_little<std::uint32_t>(bytes, 16),
      .pfnc = get_little<std::uint32_t>(bytes, 20),
      .frame_id = get_little<std::uint64_t>(bytes, 24),
      .time = DeviceTime<CameraCounter>(nanoseconds(static_cast<std::int64_t>(get_little<std::uint64_t>(bytes, 32)))),
      .status = static_cast<ImageStatus>(status),
      .missing_packets = get_little<std::uint32_t>(bytes, 44),
      .offset_x = get_little<std::uint32_t>(bytes, 48),
      .offset_y = get_little<std::uint32_t>(bytes, 52),
      .exposure = nanoseconds(get_little<std::uint32_t>(bytes, 56)),
      .gain = std::bit_cast<float>(get_little<std::uint32_t>(bytes, 60)),
  };
  if (!(header.gain >= 0) || !std::isfinite(header.gain))
    return Error{ErrorCode::Malformed, fmt::format("image packet with a reported gain of {}", header.gain)};
  const auto format = pixel_format_of(header.pfnc);
  if (format && header.stride < std::uint64_t{header.width} * bytes_per_pixel(*format))
    return Error{ErrorCode::Malformed, fmt::format("image packet: a stride of {} bytes does not hold {} pixels of {}",
                                                   header.stride, header.width, name(*format))};
  return header;
}

}  // namespace hueline::drivers
