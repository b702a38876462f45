#pragma once

#include "calibration/lens/board.hpp"
#include "core/measurements.hpp"
#include "fusion/rig_geometry.hpp"

namespace hueline::survey {

/// Returns the grey levels of one lens in the image of its camera, in full size: (R + 2 G + B) / 4, of a Bayer mosaic
/// smoothed over 3 x 3 pixels. Empty if the camera's image is too small for the lens.
calibration::GreyImage grey_lens_image(const Image& image, const fusion::LensMount& lens);

}  // namespace hueline::survey
