#pragma once

#include <map>
#include <string>

#include "config/section.hpp"
#include "fusion/rig_geometry.hpp"

namespace hueline::config {

/// The `head` section of a rig: mounting, panorama and lenses. `cameras` maps the names of camera sensors to their ids.
fusion::CameraHeadGeometry read_head(Section section, const std::map<std::string, SensorId>& cameras);

/// One lens's `model`, `focal_px`, `principal_point_px`, `distortion`, size: what `hueline calibrate lens` writes and `hueline
/// colour` reads alone.
fusion::CameraIntrinsics read_intrinsics(Section& section);

}  // namespace hueline::config
