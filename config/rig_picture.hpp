#pragma once

#include <string>

#include "config/rig.hpp"

namespace hueline::config {

/// Draws the rig as an SVG picture: plan and side view of the vehicle with the axes and the lever arm of every sensor,
/// the lenses of the head enlarged, and the numbers beside them. x is red, y green, z blue. The picture shows mistakes
/// that are hard to see in the numbers, such as an axis with the wrong sign or a lens that looks at the ground.
std::string rig_svg(const Rig& rig);

}  // namespace hueline::config
