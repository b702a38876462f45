#pragma once

#include <cstdint>
#include <vector>

#include "fusion/rig_geometry.hpp"

namespace hueline::fusion {

/// Polygons as a bitmap with one bit for each pixel. A pixel is masked if its centre lies inside a polygon (even-odd
/// rule), or within `grow_px` of such a pixel, because interpolation there would mix in the masked object. Immutable. A
/// mask without polygons needs no memory.
class PixelMask {
 public:
  PixelMask() = default;
  PixelMask(const std::vector<Polygon>& polygons, std::uint32_t width, std::uint32_t height, std::uint32_t grow_px);

  bool is_empty() const { return bits_.empty(); }
  /// Returns whether a pixel is masked; `x` and `y` must lie inside the image.
  bool covers(std::uint32_t x, std::uint32_t y) const {
    return !bits_.empty() && (bits_[y * words_per_row_ + (x >> 6)] >> (x & 63u) & 1u) != 0;
  }

 private:
  std::size_t words_per_row_ = 0;
  std::vector<std::uint64_t> bits_;
};

}  // namespace hueline::fusion
