#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hueline::survey {

/// An object that somebody picked in an image.
struct ObjectPick {
  std::string name;
  std::uint32_t exposure = 0;  ///< number of the exposure, as in cloud.las
  std::string lens;            ///< name of the lens in the rig; empty: the pixel is in the panorama
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< The centre of the first pixel is (0, 0).
};

/// Reads picks from CSV text (docs/formats.md). The first line has the columns exposure, u_px and v_px, and optionally
/// name and lens. `file` is the name of the file in messages.
/// Errors: Malformed, with the line.
Result<std::vector<ObjectPick>> parse_object_picks(const std::string& text, const std::string& file);

}  // namespace hueline::survey
