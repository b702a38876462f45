#pragma once

#include <cstddef>
#include <vector>

#include "calibration/lens/board.hpp"

namespace hueline::calibration {

/// A blurred grey image that can be read between its pixels. Grey levels are 0 to 1. Immutable.
class BlurredImage {
 public:
  /// `blur_px` is the standard deviation of a Gauss filter that is cut off at four of them; 0: no blur. The image
  /// continues beyond its borders as its mirror image.
  BlurredImage(const GreyImage& image, float blur_px);

  float blur_px() const { return blur_px_; }
  /// Returns whether a pixel and its slope can be read.
  bool contains(float u, float v) const {
    return u >= 1 && v >= 1 && u < static_cast<float>(width_ - 2) && v < static_cast<float>(height_ - 2);
  }
  /// Returns the grey level, interpolated linearly. `contains(u, v)` must be true for these three functions.
  float at(float u, float v) const {
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const float a = u - static_cast<float>(x), b = v - static_cast<float>(y);
    const float* p = values_.data() + static_cast<std::ptrdiff_t>(y) * width_ + x;
    const float* q = p + width_;
    return (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * q[0] + a * q[1]);
  }
  float slope_u(float u, float v) const { return at(u + 0.5F, v) - at(u - 0.5F, v); }
  float slope_v(float u, float v) const { return at(u, v + 0.5F) - at(u, v - 0.5F); }

 private:
  int width_, height_;
  float blur_px_;
  std::vector<float> values_;
};

}  // namespace hueline::calibration
