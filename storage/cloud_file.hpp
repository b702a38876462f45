#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "storage/pcd_reader.hpp"

/// Reads point clouds of one moment with all their fields, in the formats in which people publish them.
namespace hueline::storage {

/// Reads a cloud. PCD, PLY, E57 (read_e57_cloud()) and LAS or LAZ are recognised by their first bytes. A name that ends
/// with .bin means rows of float32, little endian, without a header, as decode_float_rows() reads them. NumPy's arrays
/// (.npy) are read by decode_npy(), PTX, PTS and rows of text by text_cloud.hpp. Everything else is taken for PCD.
/// Errors: Io; Malformed, Truncated; Unsupported, with the limit that is exceeded or with what to do.
Result<PcdCloud> read_cloud(const std::string& path);

/// Returns whether a file that begins so is PLY.
bool is_ply(std::string_view first_bytes);
/// Reads PLY, ascii or binary of either byte order, whose vertices are its first element and have no lists. `name`
/// stands for the file in messages.
Result<PcdCloud> decode_ply(std::span<const std::byte> bytes, const std::string& name);
/// Reads rows of float32: x, y, z, intensity, and behind them a ring if the size allows it and each fifth value is a
/// whole number of 0 to 255. Rows of 3, 5 or 6 numbers are known by their values, which are more similar within a
/// column than between columns; what is behind the intensity is then called column_5 and column_6.
Result<PcdCloud> decode_float_rows(std::span<const std::byte> bytes, const std::string& name);

/// Reads a NumPy array of float32 or float64, little endian, row by row: a point a row, with the columns of
/// decode_float_rows(). Errors: Malformed, Truncated, Unsupported (an array of another kind).
Result<PcdCloud> decode_npy(std::span<const std::byte> bytes, const std::string& name);

}  // namespace hueline::storage
