#include <linux/videodev2.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <span>

#include "drivers/v4l2/v4l2_decoder.hpp"

// The first byte chooses a pixel format, the second the size, the third whether the header is repaired so that the rest
// is reached. Every byte is counted once, and a whole image has all its rows.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  if (size < 3) return 0;
  const auto formats = drivers::v4l2_formats();
  const drivers::V4l2Format& format = formats[data[0] % formats.size()];
  const std::uint32_t width = 1 + data[1] % 16u, height = 1 + data[1] / 16u;
  const bool is_repaired = data[2] % 4 != 0;
  const auto rest = std::as_bytes(std::span(data, size)).subspan(3);
  std::vector<std::byte> bytes(rest.begin(), rest.end());
  if (is_repaired) {
    bytes.insert(bytes.begin(), drivers::kV4l2HeaderSize, std::byte{0});
    drivers::V4l2Header header{.width = width, .height = height, .fourcc = format.fourcc};
    header.stride = static_cast<std::uint32_t>(format.row_bytes(width)) + data[2] / 64u;
    header.used_bytes = static_cast<std::uint32_t>(rest.size());
    if (!rest.empty()) header.colour_space = std::to_integer<std::uint32_t>(rest[0]);
    drivers::encode_v4l2_header(header, std::span(bytes).first<drivers::kV4l2HeaderSize>());
  }
  drivers::V4l2Decoder decoder({.width = width, .height = height, .fourcc = format.fourcc});
  std::vector<Measurement> out;
  const Packet packet{.sensor = 1, .bytes = Buffer::copy_of(bytes)};
  decoder.decode(packet, out);
  decoder.reset();
  decoder.decode(packet, out);
  for (const auto& m : out)
    if (const auto* image = std::get_if<Image>(&m); image && image->is_complete) {
      const auto pixels = image->pixels();
      const std::uint64_t row = std::uint64_t{image->width} * drivers::converted_pixel_bytes(image->format);
      if (pixels.size() < std::uint64_t{image->stride} * (image->height - 1) + row) std::abort();
    }
  const auto& counts = decoder.counts();
  if (counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes != 2 * bytes.size()) std::abort();
  return 0;
}
