#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "storage/byte_order.hpp"

namespace hueline::storage {

using Rgb = std::array<std::uint8_t, 3>;

/// An 8-bit RGB image. The first row is the top row.
struct RgbImage {
  int width = 0, height = 0;
  std::vector<Rgb> pixels;

  RgbImage() = default;
  RgbImage(int w, int h, Rgb fill) : width(w), height(h), pixels(static_cast<std::size_t>(w) * h, fill) {}
  Rgb& at(int x, int y) { return pixels[static_cast<std::size_t>(y) * width + x]; }
  const Rgb& at(int x, int y) const { return pixels[static_cast<std::size_t>(y) * width + x]; }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
};

/// The pixels of a picture in memory that somebody else owns: three bytes each, row by row without gaps.
struct RgbPixels {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0;
};

/// Encodes a picture as PNG. It contains no time stamp: the same picture gives the same bytes. Errors: Invalid (no
/// pixels).
Result<Bytes> encode_png(RgbPixels picture);
/// Writes a PNG file and replaces an existing one. It contains no time stamp: the same picture gives the same bytes.
/// Errors: Invalid (no pixels), Io.
Status write_png(const std::filesystem::path& path, const RgbImage& image);
/// Largest picture that is read: a panorama of 16384 x 8192 pixels.
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 27;
/// Returns the error Unsupported, which names the picture's size and kMostPixels.
Error too_many_pixels(std::uint64_t width, std::uint64_t height);

/// Reads a picture file whole. Errors: those of InputFile; Unsupported (more than 1 GiB).
Result<Bytes> read_picture_file(const std::filesystem::path& path);
/// Decodes any PNG and converts it to RGB of 8 bits; transparent pixels keep their colour. Errors: Malformed,
/// Unsupported (more than kMostPixels).
Result<RgbImage> decode_png(ByteView png);
/// A picture of 16 bits: three values a pixel, row by row.
struct WideImage {
  int width = 0, height = 0;
  std::vector<std::uint16_t> values;
};
/// Decodes a PNG whose samples have 16 bits, with its values as they stand, whatever curve it states. Nothing: it has
/// fewer bits, or transparent pixels. Errors: Malformed, Unsupported (more than kMostPixels).
Result<std::optional<WideImage>> decode_wide_png(ByteView png);
/// Returns how many bits the largest value takes.
unsigned used_bits(const WideImage& image);
/// Returns the 8 highest bits of the values, which are taken 2 to the `bits` times as large first.
RgbImage raised(const WideImage& image, unsigned bits);
/// Returns `decoded`, which decode_png() made of `png`, as bright as its camera gave it: values of 10, 12 or 14 bits,
/// as many cameras' programs put them into the 16 bits of a PNG, fill its 8 bits. Pictures with transparent pixels stay
/// as they are. Errors: Malformed.
Result<RgbImage> brightened_png(ByteView png, RgbImage decoded);
/// Reads a PNG file, as decode_png(). Errors: also those of read_picture_file().
Result<RgbImage> read_png(const std::filesystem::path& path);

}  // namespace hueline::storage
