#include "storage/png.hpp"

#include <png.h>

#include <cstring>
#include <string>

#include "core/input_file.hpp"
#include "storage/file_writer.hpp"

namespace hueline::storage {
namespace {

constexpr std::uint64_t kMostBytes = 1u << 30;

png_image fresh_image() {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  return image;
}

}  // namespace

Error too_many_pixels(const std::filesystem::path& path, std::uint64_t width, std::uint64_t height) {
  return {ErrorCode::Unsupported, path.string() + ": " + std::to_string(width) + " x " + std::to_string(height) +
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
  Result<FileWriter> file = FileWriter::create(path, IfExists::Replace);
  if (!file) return file.error();
  if (Status written = file->write(ByteView(*bytes)); !written) return written;
  return file->close();
}

Result<RgbImage> read_png(const std::filesystem::path& path) {
  Result<InputFile> file = InputFile::open(path);
  if (!file) return file.error();
  if (file->size() > kMostBytes) return Error{ErrorCode::Unsupported, path.string() + ": a PNG of more than 1 GiB"};
  Bytes bytes(static_cast<std::size_t>(file->size()));
  if (Status done = file->read(0, bytes); !done) return done.error();
  png_image image = fresh_image();
  const auto broken = [&] {
    Error error{ErrorCode::Malformed, path.string() + ": " + image.message};
    png_image_free(&image);
    return error;
  };
  if (!png_image_begin_read_from_memory(&image, bytes.data(), bytes.size())) return broken();
  if (std::uint64_t{image.width} * image.height > kMostPixels) {
    png_image_free(&image);
    return too_many_pixels(path, image.width, image.height);
  }
  image.format = PNG_FORMAT_RGB;
  RgbImage picture(static_cast<int>(image.width), static_cast<int>(image.height), {});
  const png_color black{0, 0, 0};
  if (!png_image_finish_read(&image, &black, picture.pixels.data(), 0, nullptr)) return broken();
  return picture;
}

}  // namespace hueline::storage
