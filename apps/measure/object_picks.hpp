#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hueline::apps {

/// An object as somebody picked it in a picture.
struct ObjectPick {
  std::string name;
  std::uint32_t exposure = 0;                       ///< as in cloud.las
  std::string lens;                                 ///< name in the rig; empty: the pixel is one of the panorama
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< centres at whole numbers
};

/// CSV (docs/formats.md): first line exposure, u_px, v_px; may have name, lens. `file` stands for the file in messages.
/// Errors: Malformed, with the line.
Result<std::vector<ObjectPick>> parse_object_picks(const std::string& text, const std::string& file);

}  // namespace hueline::apps
