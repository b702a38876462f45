#pragma once

#include <string>

#include "config/rig.hpp"

namespace hueline::config {

/// The rig as a picture (SVG): plan and side view of the vehicle with every sensor's axes and lever arm, the head's
/// lenses enlarged, and the numbers beside. A look finds what reading does not: an axis the wrong way round, a lens
/// that looks at the ground. x red, y green, z blue.
std::string rig_svg(const Rig& rig);

}  // namespace hueline::config
