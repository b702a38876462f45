#pragma once

#include <cstdint>
#include <vector>

#include "calibration/lens/board.hpp"

namespace hueline::calibration {

/// An image reduced by the factor `shrink`, with one byte a pixel, that can be read between pixels.
struct AlignmentPicture {
  int width = 0, height = 0;
  float shrink = 1;
  std::vector<std::uint8_t> values;

  /// Returns the value at a pixel (`u`, `v`) of the full image, or a negative number outside.
  float at(float u, float v) const {
    const float x = (u + 0.5F) / shrink - 0.5F, y = (v + 0.5F) / shrink - 0.5F;
    if (!(x >= 0 && y >= 0 && x < static_cast<float>(width - 1) && y < static_cast<float>(height - 1))) return -1;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const float a = x - static_cast<float>(column), b = y - static_cast<float>(row);
    const std::uint8_t* p = values.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(column);
    return (1 - b) * ((1 - a) * static_cast<float>(p[0]) + a * static_cast<float>(p[1])) +
           b * ((1 - a) * static_cast<float>(p[width]) + a * static_cast<float>(p[width + 1]));
  }
};

/// Returns the edges of an image, spread over `blur_px`. A gradient is divided by the gradients around it, so that
/// leaves are not stronger than a post. 255 is a strong edge.
AlignmentPicture edge_picture(const GreyImage& image, float blur_px);
/// Returns the grey levels of an image, each as its share of darker pixels, spread over `blur_px`.
AlignmentPicture grey_picture(const GreyImage& image, float blur_px);

}  // namespace hueline::calibration
