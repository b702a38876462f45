#include "storage/point_canvas.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/portable_math.hpp"

namespace hueline::storage {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();

/// A neighbour of a pixel: its offset, in which of eight directions it lies, and its weight.
struct Neighbour {
  int dx, dy;
  unsigned direction;
  float weight;
};

/// Weighted sums over neighbours, and the directions in which they lie.
struct Sum {
  unsigned directions = 0;
  float weights = 0, depth = 0, colour[3] = {0, 0, 0};
  void add(const Neighbour& n, float d, const Rgb& c) {
    directions |= n.direction;
    weights += n.weight;
    depth += n.weight * d;
    for (std::size_t k = 0; k < 3; ++k) colour[k] += n.weight * c[k];
  }
};

/// Returns `count` neighbours within `radius` pixels, spread evenly (a sunflower's spiral).
std::vector<Neighbour> neighbours_within(double radius, int count) {
  std::vector<Neighbour> all;
  for (int k = 0; k < count; ++k) {
    const double r = radius * std::sqrt((k + 0.5) / count), angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const int dx = static_cast<int>(std::lround(r * portable::cos(angle))),
              dy = static_cast<int>(std::lround(r * portable::sin(angle)));
    if (dx == 0 && dy == 0) continue;
    const double turn =
        portable::atan2(dy, dx) / (2 * std::numbers::pi) + 1.0 + 1.0 / 16;  // the axes lie inside a sector
    all.push_back({dx, dy, 1u << (static_cast<int>(turn * 8) % 8), 1.0f / static_cast<float>(dx * dx + dy * dy)});
  }
  return all;
}

}  // namespace

PointView::PointView(const Eigen::Vector3d& eye, double heading, double pitch, double focal, int width, int height)
    : eye_(eye), focal_(focal), cx_((width - 1) / 2.0), cy_((height - 1) / 2.0) {
  const double ch = portable::cos(heading), sh = portable::sin(heading);
  const double cp = portable::cos(pitch), sp = portable::sin(pitch);
  forward_ = {sh * cp, ch * cp, sp};
  right_ = {ch, -sh, 0};
  down_ = forward_.cross(right_);
}

PointCanvas::PointCanvas(int width, int height) : image(width, height, {}), depth(image.pixels.size(), kEmpty) {}

void draw_disc(PointCanvas& canvas, double x, double y, double radius_px, double depth, double radius_m, Rgb colour) {
  const int left = static_cast<int>(std::floor(x - radius_px)), right = static_cast<int>(std::ceil(x + radius_px));
  const int top = static_cast<int>(std::floor(y - radius_px)), bottom = static_cast<int>(std::ceil(y + radius_px));
  const double reach = std::max(radius_px * radius_px, 0.5);
  for (int row = std::max(0, top); row <= std::min(canvas.image.height - 1, bottom); ++row)
    for (int column = std::max(0, left); column <= std::min(canvas.image.width - 1, right); ++column) {
      const double share = ((column - x) * (column - x) + (row - y) * (row - y)) / reach;
      if (share > 1) continue;
      const std::size_t i = static_cast<std::size_t>(row) * canvas.image.width + column;
      const auto d = static_cast<float>(depth + radius_m * share);
      if (d >= canvas.depth[i]) continue;
      canvas.depth[i] = d;
      canvas.image.pixels[i] = colour;
    }
}

void close_gaps(PointCanvas& canvas, double radius, int count) {
  constexpr int kDirectionsNeeded = 6;
  constexpr float kBehind = 1.12f;  // factor of the neighbour's depth
  const std::vector<Neighbour> neighbours = neighbours_within(radius, count);
  const PointCanvas before = canvas;
  for (int y = 0; y < canvas.image.height; ++y)
    for (int x = 0; x < canvas.image.width; ++x) {
      const std::size_t i = canvas.index(x, y);
      Sum all, front;  // front: only of the nearest surface around
      float nearest = kEmpty;
      for (const Neighbour& n : neighbours)
        if (before.image.contains(x + n.dx, y + n.dy))
          nearest = std::min(nearest, before.depth[before.index(x + n.dx, y + n.dy)]);
      if (!(nearest * kBehind < before.depth[i])) continue;
      for (const Neighbour& n : neighbours) {
        if (!before.image.contains(x + n.dx, y + n.dy)) continue;
        const std::size_t j = before.index(x + n.dx, y + n.dy);
        if (!(before.depth[j] * kBehind < before.depth[i])) continue;
        all.add(n, before.depth[j], before.image.pixels[j]);
        if (before.depth[j] < nearest * kBehind) front.add(n, before.depth[j], before.image.pixels[j]);
      }
      if (std::popcount(all.directions) < kDirectionsNeeded) continue;
      const Sum& taken = std::popcount(front.directions) >= kDirectionsNeeded ? front : all;
      canvas.depth[i] = taken.depth / taken.weights;
      for (std::size_t k = 0; k < 3; ++k)
        canvas.image.pixels[i][k] = static_cast<std::uint8_t>(taken.colour[k] / taken.weights + 0.5f);
    }
}

}  // namespace hueline::storage
