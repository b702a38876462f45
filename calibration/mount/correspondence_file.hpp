#pragma once

#include <string>
#include <vector>

#include "calibration/mount/resection.hpp"

namespace hueline::calibration {

/// The points of one lens in a file of correspondences.
struct LensCorrespondences {
  std::string lens;  ///< value of the column `lens`; empty if the file has no such column
  std::vector<Correspondence> points;
};

/// Reads a text with a header line and the columns u_px, v_px, x_m, y_m and z_m in any order (docs/formats.md). Commas
/// or semicolons separate the columns. The columns name and lens are optional. Pixels are those of the lens image;
/// metres are in the scanner's frame. Lines that begin with # are comments. `file` is the name of the file in messages.
/// Errors: Malformed, with line and column (a column is missing, repeated or unknown; a value is not a number; a point
/// is farther than any scanner measures, which suggests millimetres).
Result<std::vector<LensCorrespondences>> parse_correspondences(const std::string& text, const std::string& file);

}  // namespace hueline::calibration
