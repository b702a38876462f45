#include "fusion/pixel_mask.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::fusion {
namespace {

/// Marks the pixels of row `y` whose centres lie inside the polygon.
void fill_row(const Polygon& polygon, double y, std::vector<std::uint8_t>& row) {
  std::vector<double> crossings;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((a.y() <= y) != (b.y() <= y)) crossings.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
  }
  std::sort(crossings.begin(), crossings.end());
  const double last = static_cast<double>(row.size()) - 1.0;
  for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
    const double from = std::max(0.0, std::ceil(crossings[i])), to = std::min(last, std::floor(crossings[i + 1]));
    for (double x = from; x <= to; ++x) row[static_cast<std::size_t>(x)] = 1;
  }
}

void grow_row(const std::vector<std::uint8_t>& row, std::size_t grow, std::vector<std::uint8_t>& grown) {
  std::fill(grown.begin(), grown.end(), std::uint8_t{0});
  for (std::size_t x = 0; x < row.size(); ++x) {
    if (row[x] == 0) continue;
    const std::size_t from = x >= grow ? x - grow : 0, to = std::min(row.size() - 1, x + grow);
    std::fill(grown.begin() + static_cast<std::ptrdiff_t>(from), grown.begin() + static_cast<std::ptrdiff_t>(to) + 1,
              std::uint8_t{1});
  }
}

}  // namespace

PixelMask::PixelMask(const std::vector<Polygon>& polygons, std::uint32_t width, std::uint32_t height,
                     std::uint32_t grow_px) {
  if (polygons.empty()) return;
  words_per_row_ = (width + 63u) / 64u;
  bits_.assign(words_per_row_ * height, 0);
  std::vector<std::uint8_t> row(width), one(width), grown(width);
  for (std::uint32_t y = 0; y < height; ++y) {
    std::fill(row.begin(), row.end(), std::uint8_t{0});
    for (const Polygon& polygon : polygons) {
      std::fill(one.begin(), one.end(), std::uint8_t{0});
      fill_row(polygon, y, one);
      for (std::uint32_t x = 0; x < width; ++x) row[x] |= one[x];
    }
    grow_row(row, grow_px, grown);
    const std::uint32_t from = y >= grow_px ? y - grow_px : 0, to = std::min(height - 1, y + grow_px);
    for (std::uint32_t x = 0; x < width; ++x) {
      if (grown[x] == 0) continue;
      for (std::uint32_t target = from; target <= to; ++target) {
        bits_[target * words_per_row_ + (x >> 6)] |= std::uint64_t{1} << (x & 63u);
      }
    }
  }
}

}  // namespace hueline::fusion
