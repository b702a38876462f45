#pragma once

#include <filesystem>

#include "storage/png.hpp"

namespace hueline::storage {

/// Reads a PNG or JPEG file as 8-bit RGB. The first bytes decide which of the two it is, not the name. The pixels are
/// returned as stored: a rotation that a photograph's EXIF data asks for is not applied, because a lens is calibrated
/// on the rows and columns of the sensor. Errors: Io; Malformed; Truncated (a JPEG cut short); Unsupported (another
/// format, or more than 134 million pixels).
Result<RgbImage> read_image(const std::filesystem::path& path);

}  // namespace hueline::storage
