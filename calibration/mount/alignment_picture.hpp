#pragma once

#include <cstdint>
#include <vector>

#include "calibration/lens/board.hpp"

namespace hueline::calibration {

/// A picture of bytes at one over `shrink` of an image's size, read between pixels.
struct AlignmentPicture {
  int width = 0, height = 0;
  float shrink = 1;
  std::vector<std::uint8_t> values;

  /// `u`, `v`: pixel of the whole image. Negative outside.
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

/// Edges: gradients, held against those around (leaves must not outshine a post), spread over `blur_px`. 255 is a
/// strong edge.
AlignmentPicture edge_picture(const GreyImage& image, float blur_px);
/// Grey levels, each as its share of darker pixels, spread over `blur_px`.
AlignmentPicture grey_picture(const GreyImage& image, float blur_px);

}  // namespace hueline::calibration
