#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/buffer.hpp"
#include "core/time.hpp"

/// Packets of a V4L2 camera (its decoder reads them) that are made of images which somebody else recorded.
/// All functions are pure. `fourcc` is one of V4L2's four characters that the decoder reads (linux/videodev2.h).
namespace hueline::drivers {

/// An image whose pixels lie elsewhere.
struct PacketImage {
  std::uint32_t sequence = 0;
  std::uint32_t width = 0, height = 0;  ///< px
  std::uint32_t stride = 0;             ///< bytes from one row to the next; 0: compressed
  UnixTime stamp{};                     ///< the start of the exposure
};

/// What V4L2 says of an image's pixels.
struct PixelLayout {
  std::uint64_t row_bytes = 0,
                image_bytes = 0;  ///< the least that they need; of rows without filling, and with `stride`
  bool has_words = false;         ///< words of 16 bits, the lower byte first
};
PixelLayout layout_of(std::string_view fourcc, const PacketImage& image);

/// Returns the packet of an image.
Buffer image_packet(std::string_view fourcc, const PacketImage& image, std::span<const std::byte> pixels);
/// Returns the four characters as the key `format` of a V4L2 camera has them.
std::string format_word(std::string_view fourcc);

/// What the head of a JPEG says.
struct JpegHead {
  std::uint32_t width = 0, height = 0;
  bool is_grey = false;
  std::string why;  ///< why the decoder does not read it; empty if nothing is known against it
};
JpegHead jpeg_head(std::span<const std::byte> jpeg);

}  // namespace hueline::drivers
