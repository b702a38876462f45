#include "sim/mask_outline.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace hueline::sim {
namespace {

// A corner of pixels: (x, y) is the upper left corner of pixel (x, y).
using Corner = std::pair<int, int>;

/// Douglas-Peucker simplification between `first` and `last`, which are both kept.
void simplify(const std::vector<Corner>& loop, std::size_t first, std::size_t last, double tolerance,
              std::vector<bool>& keep) {
  double worst = 0;
  std::size_t at = first;
  const double dx = loop[last].first - loop[first].first, dy = loop[last].second - loop[first].second,
               chord = std::hypot(dx, dy);
  for (std::size_t i = first + 1; i < last; ++i) {
    const double px = loop[i].first - loop[first].first, py = loop[i].second - loop[first].second;
    const double off = chord > 0 ? std::abs(px * dy - py * dx) / chord : std::hypot(px, py);
    if (off > worst) {
      worst = off;
      at = i;
    }
  }
  if (worst <= tolerance) return;
  keep[at] = true;
  simplify(loop, first, at, tolerance, keep);
  simplify(loop, at, last, tolerance, keep);
}

}  // namespace

std::vector<std::vector<TruePixel>> mask_outline(const std::vector<std::uint8_t>& mask, int width, int height, int grow,
                                                 double tolerance) {
  // The mask is grown beyond the image's borders too, so that simplified corners do not uncover pixels there.
  const int w = width + 2 * grow, h = height + 2 * grow;
  std::vector<bool> grown(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] == 0)
        continue;
      for (int v = y; v <= y + 2 * grow; ++v)
        for (int u = x; u <= x + 2 * grow; ++u)
          grown[static_cast<std::size_t>(v) * static_cast<std::size_t>(w) + static_cast<std::size_t>(u)] = true;
    }
  const auto inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < w && y < h &&
           grown[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)];
  };
  // The sides between a covered and a free pixel, directed so that the covered pixel is on the right.
  std::multimap<Corner, Corner> sides;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      if (!inside(x, y)) continue;
      if (!inside(x, y - 1)) sides.insert({{x, y}, {x + 1, y}});
      if (!inside(x + 1, y)) sides.insert({{x + 1, y}, {x + 1, y + 1}});
      if (!inside(x, y + 1)) sides.insert({{x + 1, y + 1}, {x, y + 1}});
      if (!inside(x - 1, y)) sides.insert({{x, y + 1}, {x, y}});
    }
  std::vector<std::vector<TruePixel>> outlines;
  while (!sides.empty()) {
    std::vector<Corner> loop{sides.begin()->first};
    for (auto next = sides.begin(); next != sides.end(); next = sides.find(loop.back())) {
      loop.push_back(next->second);
      sides.erase(next);
      if (loop.back() == loop.front()) break;
    }
    std::vector<bool> keep(loop.size());
    keep[0] = keep[loop.size() / 2] = true;
    simplify(loop, 0, loop.size() / 2, tolerance, keep);
    simplify(loop, loop.size() / 2, loop.size() - 1, tolerance, keep);
    std::vector<TruePixel> outline;
    for (std::size_t i = 0; i + 1 < loop.size(); ++i)
      if (keep[i]) outline.push_back({loop[i].first - grow - 0.5, loop[i].second - grow - 0.5});
    if (outline.size() >= 3) outlines.push_back(std::move(outline));
  }
  return outlines;
}

}  // namespace hueline::sim
