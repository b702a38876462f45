#pragma once

#include <string>
#include <vector>

#include "calibration/mount/resection.hpp"

namespace hueline::calibration {

/// Points of one lens out of a file.
struct LensCorrespondences {
  std::string lens;  ///< as the column `lens` says; empty where there is none
  std::vector<Correspondence> points;
};

/// Text with a header line; the columns u_px, v_px, x_m, y_m, z_m in any order, comma or semicolon between them, and if
/// wanted name and lens (docs/formats.md). Pixels of the lens image, metres in the scanner's frame. Lines that begin
/// with # are for people. `file` stands for the file in messages. Errors: Malformed, with line and column: a column is
/// missing, is there twice or is unknown; no number; a point farther than any scanner measures (millimetres?).
Result<std::vector<LensCorrespondences>> parse_correspondences(const std::string& text, const std::string& file);

}  // namespace hueline::calibration
