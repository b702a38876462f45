#pragma once

#include <filesystem>

#include "storage/png.hpp"

namespace hueline::storage {

/// Decodes a PNG or JPEG as 8-bit RGB. The first bytes decide which of the two it is. The pixels are returned as
/// stored: a rotation that a photograph's EXIF data asks for is not applied, because a lens is calibrated on the rows
/// and columns of the sensor. Errors: Malformed; Truncated (a JPEG cut short); Unsupported (another format, or more
/// than 134 million pixels).
Result<RgbImage> decode_image(ByteView bytes);

/// Returns whether a file with these first bytes is one that decode_image() decodes.
bool is_image(ByteView first_bytes);

/// An image file: its pixels as stored, and how its EXIF data want it to be shown (core/exif_orientation.hpp).
struct StoredImage {
  RgbImage image;
  int orientation = 1;
};
/// Reads a PNG or JPEG file, whatever its name, as decode_image(), and a PNG of 16 bits as brightened_png(). Errors:
/// also those of read_picture_file().
Result<StoredImage> read_image(const std::filesystem::path& path);

}  // namespace hueline::storage
