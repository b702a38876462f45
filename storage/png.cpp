#include "storage/png.hpp"

#include <png.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/output_file.hpp"
#include "core/sample_bits.hpp"

namespace hueline::storage {
namespace {

png_image fresh_image() {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  return image;
}

/// Returns the PNG without what it says of its curve and colours, so that its numbers are read as they stand.
Bytes without_colour_space(ByteView png) {
  constexpr std::size_t kSignature = 8, kFrame = 12;  // of a chunk: length, name, check sum
  Bytes out(png.begin(), png.begin() + kSignature);
  for (std::size_t at = kSignature; at + kFrame <= png.size();) {
    std::size_t length = kFrame;
    for (std::size_t i = 0; i < 4; ++i) length += std::to_integer<std::size_t>(png[at + i]) << (8 * (3 - i));
    length = std::min(length, png.size() - at);
    const std::string_view name(reinterpret_cast<const char*>(png.data() + at + 4), 4);
    if (name != "gAMA" && name != "cHRM" && name != "sRGB" && name != "iCCP")
      out.insert(out.end(), png.begin() + static_cast<std::ptrdiff_t>(at),
                 png.begin() + static_cast<std::ptrdiff_t>(at + length));
    at += length;
  }
  return out;
}

/// Returns whether a PNG says that its samples have 16 bits.
bool is_wide_png(ByteView png) {
  constexpr std::size_t kBits = 24;  // behind the signature and the frame, width and height of the first chunk
  return png.size() > kBits && std::to_integer<int>(png[kBits]) == 16;
}

}  // namespace

Error too_many_pixels(std::uint64_t width, std::uint64_t height) {
  return {ErrorCode::Unsupported, std::to_string(width) + " x " + std::to_string(height) +
                                      " pixels; pictures of at most 134 million (16384 x 8192) are read"};
}

Result<Bytes> encode_png(RgbPixels picture) {
  if (picture.width <= 0 || picture.height <= 0) return Error{ErrorCode::Invalid, "a picture without pixels"};
  png_image image = fresh_image();
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);  // asking for the size would compress it once more
  Bytes bytes(size);
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.data, 0, nullptr))
    return Error{ErrorCode::Invalid, image.message};
  bytes.resize(size);
  return bytes;
}

Status write_png(const std::filesystem::path& path, const RgbImage& picture) {
  // The picture is encoded in memory first, so that a write error is noticed here.
  const std::uint8_t* pixels = picture.pixels.empty() ? nullptr : picture.pixels.data()->data();
  const Result<Bytes> bytes = encode_png({pixels, picture.width, picture.height});
  if (!bytes.ok()) return Error{bytes.error().code, path.string() + ": " + bytes.error().message};
  return write_output(path, *bytes);
}

Result<Bytes> read_picture_file(const std::filesystem::path& path) {
  constexpr std::uint64_t kMostBytes = 1u << 30;
  Result<InputFile> file = InputFile::open(path);
  if (!file) return file.error();
  if (file->size() > kMostBytes) return Error{ErrorCode::Unsupported, path.string() + ": a picture of more than 1 GiB"};
  Bytes bytes(static_cast<std::size_t>(file->size()));
  if (Status done = file->read(0, bytes); !done) return done.error();
  return bytes;
}

Result<RgbImage> decode_png(ByteView png) {
  png_image image = fresh_image();
  const auto broken = [&] {
    Error error{ErrorCode::Malformed, image.message};
    png_image_free(&image);
    return error;
  };
  if (!png_image_begin_read_from_memory(&image, png.data(), png.size())) return broken();
  if (std::uint64_t{image.width} * image.height > kMostPixels) {
    png_image_free(&image);
    return too_many_pixels(image.width, image.height);
  }
  // The pixels are wanted as they are stored: 16 bits have the curve of sRGB as 8 bits have it, unless the file says
  // otherwise, and what is transparent keeps its colour.
  image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  const bool has_alpha = (image.format & PNG_FORMAT_FLAG_ALPHA) != 0;
  image.format = has_alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  RgbImage picture(static_cast<int>(image.width), static_cast<int>(image.height), {});
  std::vector<std::uint8_t> with_alpha(has_alpha ? PNG_IMAGE_SIZE(image) : 0);
  void* const into = has_alpha ? static_cast<void*>(with_alpha.data()) : picture.pixels.data();
  if (!png_image_finish_read(&image, nullptr, into, 0, nullptr)) return broken();
  for (std::size_t i = 0; i < with_alpha.size() / 4; ++i) std::copy_n(&with_alpha[4 * i], 3, picture.pixels[i].begin());
  return picture;
}

Result<std::optional<WideImage>> decode_wide_png(ByteView png) {
  png_image image = fresh_image();
  const auto broken = [&] {
    Error error{ErrorCode::Malformed, image.message};
    png_image_free(&image);
    return error;
  };
  const auto nothing = [&] {
    png_image_free(&image);
    return std::optional<WideImage>();
  };
  if (!is_wide_png(png)) return std::optional<WideImage>();
  const Bytes plain = without_colour_space(png);
  if (!png_image_begin_read_from_memory(&image, plain.data(), plain.size())) return broken();
  if (std::uint64_t{image.width} * image.height > kMostPixels) {
    png_image_free(&image);
    return too_many_pixels(image.width, image.height);
  }
  // Values of 16 bits without a curve stay as they stand. Transparent pixels would be mixed with black.
  if ((image.format & PNG_FORMAT_FLAG_LINEAR) == 0 || (image.format & PNG_FORMAT_FLAG_ALPHA) != 0) return nothing();
  image.format |= PNG_FORMAT_FLAG_COLOR;
  WideImage out{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  out.values.resize(std::size_t{image.width} * image.height * PNG_IMAGE_PIXEL_CHANNELS(image.format));
  if (!png_image_finish_read(&image, nullptr, out.values.data(), 0, nullptr)) return broken();
  return std::optional(std::move(out));
}

unsigned used_bits(const WideImage& image) {
  unsigned all = 0;
  for (const std::uint16_t value : image.values) all |= value;
  return static_cast<unsigned>(std::bit_width(all));
}

RgbImage raised(const WideImage& image, unsigned bits) {
  constexpr unsigned kMost = 0xFFFF;
  RgbImage out(image.width, image.height, {});
  for (std::size_t i = 0; i < image.values.size(); ++i)
    out.pixels[i / 3][i % 3] = static_cast<std::uint8_t>(std::min(unsigned{image.values[i]} << bits, kMost) >> 8U);
  return out;
}

Result<RgbImage> brightened_png(ByteView png, RgbImage decoded) {
  constexpr std::uint8_t kLeastOf14Bits = 64;
  for (const Rgb& pixel : decoded.pixels)
    if (std::ranges::max(pixel) >= kLeastOf14Bits) return decoded;
  const auto wide = decode_wide_png(png);
  if (!wide.ok()) return wide.error();
  return *wide ? raised(**wide, empty_bits(used_bits(**wide))) : std::move(decoded);
}

Result<RgbImage> read_png(const std::filesystem::path& path) {
  const auto bytes = read_picture_file(path);
  if (!bytes) return bytes.error();
  auto picture = decode_png(*bytes);
  if (!picture) return Error{picture.error().code, path.string() + ": " + picture.error().message};
  return picture;
}

}  // namespace hueline::storage
