#pragma once

#include "calibration/lens/board.hpp"
#include "core/measurements.hpp"
#include "fusion/rig_geometry.hpp"

namespace hueline::runtime {

/// Returns the grey levels of one lens in the image of its camera, (R + 2 G + B) / 4: in full size, where a Bayer
/// mosaic is smoothed over 3 x 3 pixels, or shrunk to the means of `cell` x `cell` pixels. Empty if the camera's image
/// is too small for the lens.
calibration::GreyImage grey_lens_image(const Image& image, const fusion::LensMount& lens, int cell = 1);

/// Returns the whole number of pixels that become one if an image of a lens may have at most `most_width` columns.
inline int cell_for(const fusion::LensMount& lens, std::uint32_t most_width) {
  return static_cast<int>((lens.intrinsics.width - 1) / most_width) + 1;
}

}  // namespace hueline::runtime
