#pragma once

#include <filesystem>
#include <functional>

#include "core/frames.hpp"
#include "core/result.hpp"
#include "storage/pcd_reader.hpp"

namespace hueline::storage {

/// Reads the points of an E57 file in the frame of the scanner, in which an image of the same moment and its
/// calibration are: the pose of the scan in the file's coordinates is not applied. Several scans are joined if they
/// have the same pose, as clouds that a program has already registered. Columns are x, y, z (NaN where nothing came
/// back), intensity, red, green, blue, normal_x, normal_y, normal_z, time_stamp (s after the scan's begin), row,
/// column, return_index (from 0), return_count, and fields of extensions under their own names; NaN in a scan that
/// lacks the field, and where the file says that a value is not valid. Errors: those of E57Reader; Unsupported if scans
/// have different poses, or beyond the limit of decode_points(); Malformed if there are no points.
Result<PcdCloud> read_e57_cloud(const std::filesystem::path& path);

/// Gives `take` the places of the same points, one after another, those without a place left out. Errors: the same.
Status read_e57_places(const std::filesystem::path& path, const std::function<void(const Point<Scanner>&)>& take);

}  // namespace hueline::storage
