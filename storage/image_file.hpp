#pragma once

#include <filesystem>

#include "storage/png.hpp"

namespace hueline::storage {

/// A PNG or a JPEG, told by its first bytes and not by its name, as 8-bit RGB. The pixels are those stored: a turn that
/// a photograph's EXIF asks for is not made, since a lens is calibrated on the sensor's rows and columns. Errors: Io;
/// Malformed; Truncated (a JPEG cut short); Unsupported (another format; more than 134 million pixels).
Result<RgbImage> read_image(const std::filesystem::path& path);

}  // namespace hueline::storage
