#include <cstdlib>

#include "tests/drivers/gige/jpeg_planes_packets.hpp"

// The input patches a whole exposure of JPEG planes (six lenses of 32 x 24 px). A patch has 4 bytes: place (16 bits),
// value, and whether to set or to flip. A last odd byte cuts the exposure. Whatever comes, bytes are counted once, an
// image has all its pixels, the regions that are reported lost are zero, and the same bytes give the same image.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hueline;
  constexpr std::uint32_t kWidth = 32, kHeight = 24;
  static const std::vector<std::byte> whole =
      test::jpeg_planes(test::lens_mosaic(3, kWidth, kHeight), 3 * kWidth, 3, 80);
  std::vector<std::byte> bytes = whole;
  for (std::size_t i = 0; i + 4 <= size; i += 4) {
    const std::size_t at = (std::size_t{data[i]} << 8 | data[i + 1]) % bytes.size();
    const auto value = static_cast<std::byte>(data[i + 2]);
    bytes[at] = (data[i + 3] & 1) != 0 ? value : bytes[at] ^ value;
  }
  if (size % 4 == 1) bytes.resize(bytes.size() * data[size - 1] / 255);
  const Packet packet = test::planes_packet(bytes);
  drivers::ImageDecoder decoder(test::planes_config(3, kWidth, kHeight)),
      again(test::planes_config(3, kWidth, kHeight));
  std::vector<Measurement> out, repeated;
  decoder.decode(packet, out);
  again.decode(packet, repeated);
  if (out.size() != repeated.size()) std::abort();
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto* image = std::get_if<Image>(&out[i]);
    if (!image) continue;
    const auto pixels = image->pixels(), same = std::get<Image>(repeated[i]).pixels();
    if (pixels.size() != std::size_t{6} * kWidth * kHeight || !std::ranges::equal(pixels, same)) std::abort();
    for (const PixelRegion& lost : image->lost)
      for (std::uint32_t y = 0; y < lost.height; ++y)
        for (std::uint32_t x = 0; x < lost.width; ++x)
          if (pixels[std::size_t{lost.y + y} * image->stride + lost.x + x] != std::byte{0}) std::abort();
  }
  const auto& counts = decoder.counts();
  if (counts.decoded_bytes + counts.ignored_bytes + counts.malformed_bytes != packet.bytes.size()) std::abort();
  return 0;
}
