#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "drivers/gige/image_decoder.hpp"
#include "sim/wire/jpeg_planes_encode.hpp"

/// Exposures as JPEG planes, made by the simulator's encoder and packed as the camera's source delivers them.
namespace hueline::test {

/// Makes a mosaic of `columns` x 6 / columns lens images. It is smooth, and different at each place of the cell and in
/// each lens.
inline std::vector<std::uint8_t> lens_mosaic(std::uint32_t columns, std::uint32_t lens_width,
                                             std::uint32_t lens_height) {
  const std::uint32_t rows = 6 / columns, width = columns * lens_width, height = rows * lens_height;
  std::vector<std::uint8_t> mosaic(std::size_t{width} * height);
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      const std::uint32_t lens = y / lens_height * columns + x / lens_width, place = y % 2 * 2 + x % 2;
      const std::uint32_t ramp = (x % lens_width + y % lens_height) * 40 / (lens_width + lens_height);
      mosaic[std::size_t{y} * width + x] = static_cast<std::uint8_t>(20 + 15 * lens + 30 * place + ramp);
    }
  return mosaic;
}

inline std::vector<std::byte> jpeg_planes(const std::vector<std::uint8_t>& mosaic, std::uint32_t width,
                                          std::uint32_t columns, int quality = 92) {
  sim::JpegPlanesImage image;
  image.mosaic = mosaic;
  image.width = width;
  image.height = static_cast<std::uint32_t>(mosaic.size() / width);
  image.lens_columns = columns;
  image.lens_rows = 6 / columns;
  image.quality = quality;
  const auto bytes = sim::encode_jpeg_planes(image);
  return bytes.ok() ? *bytes : std::vector<std::byte>();
}

/// Puts the planes into a buffer of rows of 64 bytes, padded with zeros.
inline Packet planes_packet(const std::vector<std::byte>& planes, std::uint64_t frame_id = 1,
                            drivers::ImageStatus status = drivers::ImageStatus::Complete) {
  constexpr std::uint32_t kRow = 64;
  drivers::ImageHeader header{.width = kRow,
                              .height = static_cast<std::uint32_t>((planes.size() + kRow - 1) / kRow),
                              .stride = kRow,
                              .pfnc = drivers::pfnc_code(PixelFormat::Mono8),
                              .frame_id = frame_id,
                              .status = status};
  std::vector<std::byte> bytes(drivers::kImageHeaderSize + header.pixel_bytes());
  drivers::encode_image_header(header, std::span(bytes).first<drivers::kImageHeaderSize>());
  std::ranges::copy(planes, bytes.begin() + drivers::kImageHeaderSize);
  return {.sensor = 3, .sequence = 77, .bytes = Buffer::copy_of(bytes)};
}

inline drivers::ImageDecoder::Config planes_config(std::uint32_t columns, std::uint32_t lens_width,
                                                   std::uint32_t lens_height) {
  drivers::ImageDecoder::Config config;
  config.payload = drivers::ImagePayload::JpegPlanes;
  config.pixel_format = PixelFormat::BayerRG8;
  config.planes.lens_columns = columns;
  config.width = columns * lens_width;
  config.height = 6 / columns * lens_height;
  return config;
}

inline std::uint32_t be32(const std::vector<std::byte>& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
  return value;
}
/// Returns where a plane lies, from the table.
struct PlacedPlane {
  std::size_t offset, size;
};
inline PlacedPlane placed(const std::vector<std::byte>& planes, std::size_t lens, std::size_t slot) {
  const std::size_t entry = 0x340 + 8 * (4 * lens + slot);
  return {be32(planes, entry), be32(planes, entry + 4)};
}

}  // namespace hueline::test
