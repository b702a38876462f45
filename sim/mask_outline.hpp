#pragma once

#include <cstdint>
#include <vector>

#include "sim/lens_optics.hpp"

namespace hueline::sim {

/// What a calibration would draw into a rig's masks: closed polygons (even-odd rule on pixel centres) around the
/// non-zero pixels of a width x height mask, after growing it by grow_px in all directions, beyond the image's borders
/// too. Corners keep within tolerance_px of the pixels' borders.
std::vector<std::vector<TruePixel>> mask_outline(const std::vector<std::uint8_t>& mask, int width, int height,
                                                 int grow_px, double tolerance_px);

}  // namespace hueline::sim
