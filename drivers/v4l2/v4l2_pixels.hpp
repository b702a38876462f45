#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/measurements.hpp"

/// The pixel formats of V4L2 cameras that are read, and what becomes of them. Colouring uses 8 bits, so of deeper
/// pixels the 8 highest bits are taken (the recording keeps all), and colour differences become red, green and blue.
namespace hueline::drivers {

/// How the pixels lie in memory.
enum class V4l2Packing : std::uint8_t {
  Bytes,   ///< as PixelFormat says: nothing has to be converted
  Words,   ///< one sample in two bytes, little endian, in the lower bits
  Mipi10,  ///< four samples in five bytes, their high bytes first (MIPI RAW10)
  Mipi12,  ///< two samples in three bytes, their high bytes first
  Mipi14,  ///< four samples in seven bytes, their high bytes first
  Bgr,     ///< blue, green, red, a byte each
  Yuyv,    ///< two pixels in four bytes: luminance, blue difference, luminance, red difference
  Yvyu,    ///< the same with the differences exchanged
  Uyvy,    ///< blue difference, luminance, red difference, luminance
  Vyuy,    ///< the same with the differences exchanged
  Nv12,    ///< all luminances, then the differences of every 2 x 2 pixels, blue and red in turn
  Nv21,    ///< the same, red and blue in turn
  Jpeg,    ///< one JPEG an image (Motion JPEG): it becomes Rgb8, or Mono8 if it is grey
};

/// One pixel format.
struct V4l2Format {
  std::uint32_t fourcc;  ///< V4L2_PIX_FMT_*
  PixelFormat image;     ///< the pixels that it becomes
  V4l2Packing packing;
  std::uint8_t bits = 8;  ///< bits of a sample, for Words

  /// Returns the bytes of one row without filling. 0 for Jpeg.
  std::uint64_t row_bytes(std::uint32_t width) const;
  /// Returns the bytes that an image needs at least, with this distance of rows. 0 for Jpeg.
  std::uint64_t image_bytes(std::uint32_t width, std::uint32_t height, std::uint32_t stride) const;
};

/// Returns all formats that are read.
std::span<const V4l2Format> v4l2_formats();
/// Returns the format with this code, or null.
const V4l2Format* find_v4l2_format(std::uint32_t fourcc);
/// Returns the four characters of a code without trailing spaces: "YUYV", "Y10". Others become `?`.
std::string fourcc_text(std::uint32_t fourcc);

/// How luminance and colour differences were made.
struct YcbcrCoding {
  double red_weight = 0.299, blue_weight = 0.114;  ///< of the luminance
  bool is_full_range = false;                      ///< 0 to 255; otherwise 16 to 235 and 16 to 240
};
/// Returns the coding that the three fields of a packet's header name, with the kernel's rules for its defaults.
YcbcrCoding ycbcr_coding(std::uint32_t colour_space, std::uint32_t encoding, std::uint32_t quantisation);

/// Returns the bytes of one pixel of a converted image: 1 or 3.
std::uint32_t converted_pixel_bytes(PixelFormat format);

/// Converts the pixels of an image to rows without filling: width x converted_pixel_bytes() bytes each. Not for
/// Bytes and Jpeg. `in` has at least image_bytes(); `out` has height rows. It uses whole numbers only, so every machine
/// makes the same bytes. Thread-safe.
void convert_v4l2_pixels(const V4l2Format& format, const YcbcrCoding& coding, std::uint32_t width, std::uint32_t height,
                         std::uint32_t stride, std::span<const std::byte> in, std::byte* out);

}  // namespace hueline::drivers
