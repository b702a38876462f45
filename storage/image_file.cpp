#include "storage/image_file.hpp"

#include <turbojpeg.h>

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "core/exif_orientation.hpp"
#include "storage/byte_order.hpp"

namespace hueline::storage {
namespace {

Result<RgbImage> decode_jpeg(ByteView bytes) {
  struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
  };
  const std::unique_ptr<void, Destroy> handle(tjInitDecompress());
  if (!handle) return Error{ErrorCode::Exhausted, "no memory for a JPEG decoder"};
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const auto broken = [&] {
    const std::string what = tjGetErrorStr2(handle.get());
    const bool is_cut = what.find("Premature end") != std::string::npos;
    return Error{is_cut ? ErrorCode::Truncated : ErrorCode::Malformed, what};
  };
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(handle.get(), data, bytes.size(), &width, &height, &subsampling, &colours) != 0)
    return broken();
  if (width <= 0 || height <= 0)  // a file of tables alone is a JPEG too
    return Error{ErrorCode::Malformed, "a JPEG without pixels"};
  if (std::uint64_t(width) * std::uint64_t(height) > kMostPixels)
    return too_many_pixels(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height));
  if (colours == TJCS_CMYK || colours == TJCS_YCCK)
    return Error{ErrorCode::Unsupported, "a JPEG with the four inks of printing (CMYK): convert it to RGB"};
  RgbImage image(width, height, {});
  if (tjDecompress2(handle.get(), data, bytes.size(), image.pixels.data()->data(), width, 0, height, TJPF_RGB,
                    TJFLAG_ACCURATEDCT) != 0) {
    // Bytes between two markers are harmless, and some cameras write them. Any other warning means wrong pixels.
    const bool is_harmless =
        tjGetErrorCode(handle.get()) == TJERR_WARNING &&
        std::string_view(tjGetErrorStr2(handle.get())).find("extraneous bytes") != std::string_view::npos;
    if (!is_harmless) return broken();
  }
  return image;
}

bool begins_with(ByteView bytes, std::string_view signature) {
  return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).starts_with(signature);
}

bool is_png(ByteView bytes) { return begins_with(bytes, "\x89PNG\r\n\x1A\n"); }

bool is_jpeg(ByteView bytes) { return begins_with(bytes, "\xFF\xD8\xFF"); }

}  // namespace

Result<RgbImage> decode_image(ByteView bytes) {
  if (is_png(bytes)) return decode_png(bytes);
  if (is_jpeg(bytes)) return decode_jpeg(bytes);
  return Error{ErrorCode::Unsupported, "is neither a PNG nor a JPEG by its first bytes"};
}

bool is_image(ByteView first_bytes) { return is_png(first_bytes) || is_jpeg(first_bytes); }

Result<StoredImage> read_image(const std::filesystem::path& path) {
  const auto bytes = read_picture_file(path);
  if (!bytes) return bytes.error();
  auto picture = decode_image(*bytes);
  if (picture.ok() && is_png(*bytes)) picture = brightened_png(*bytes, std::move(picture.value()));
  if (!picture) return Error{picture.error().code, path.string() + ": " + picture.error().message};
  const std::string_view file(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  return StoredImage{std::move(picture.value()), exif_orientation(file)};
}

}  // namespace hueline::storage
