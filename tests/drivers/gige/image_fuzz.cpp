#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>

#include "drivers/gige/image_decoder.hpp"

// The input is one image packet. If its first byte is odd, the fixed part of the header is repaired, so that the fields
// after it are reached. An image that comes out lies within the packet, and every byte is counted once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  std::vector<std::byte> bytes(size);
  std::ranges::copy(std::as_bytes(std::span(data, size)), bytes.begin());
  if (size >= drivers::kImageHeaderSize && (data[0] & 1)) {
    std::array<std::byte, drivers::kImageHeaderSize> header;
    drivers::encode_image_header({.pfnc = drivers::pfnc_code(PixelFormat::BayerRG8)}, header);
    std::copy_n(header.begin(), 8, bytes.begin());
    std::copy_n(header.begin() + 40, 4, bytes.begin() + 40);
    if (data[0] & 2) std::copy_n(header.begin() + 20, 4, bytes.begin() + 20);
    // Small sizes, so that some images fit.
    if (data[0] & 4) std::fill_n(bytes.begin() + 9, 3, std::byte{0});
    if (data[0] & 8) std::fill_n(bytes.begin() + 13, 3, std::byte{0});
    if (data[0] & 16) std::fill_n(bytes.begin() + 18, 2, std::byte{0});
  }
  drivers::ImageDecoder decoder({});
  std::vector<Measurement> out;
  const Packet packet{.sensor = 1, .bytes = Buffer::copy_of(bytes)};
  decoder.decode(packet, out);
  decoder.decode(packet, out);
  for (const auto& m : out)
    if (const auto* image = std::get_if<Image>(&m)) {
      const auto pixels = image->pixels();
      if (pixels.size() < std::uint64_t{image->stride} * image->height) std::abort();
      if (!pixels.empty() && (pixels.front() ^ pixels.back()) == std::byte{1}) out.reserve(out.size());
    }
  const auto& counts = decoder.counts();
  if (counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes != 2 * size) std::abort();
  return 0;
}
