#pragma once

#include <cstdint>
#include <vector>

#include "sim/lens_optics.hpp"

namespace hueline::sim {

/// Returns the polygons that a calibration would draw into the masks of a rig: closed polygons (even-odd rule on pixel
/// centres) around the non-zero pixels of a width x height mask. The mask is grown by `grow_px` in all directions
/// first, beyond the borders of the image too. Corners stay within `tolerance_px` of the pixels' borders.
std::vector<std::vector<TruePixel>> mask_outline(const std::vector<std::uint8_t>& mask, int width, int height,
                                                 int grow_px, double tolerance_px);

}  // namespace hueline::sim
