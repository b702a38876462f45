#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "storage/cloud_picture.hpp"
#include "storage/point_colour.hpp"

namespace hueline::storage {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();

struct Canvas {
  RgbImage image;
  std::vector<float> depth;  // m along the optical axis
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * image.width + x; }
};

Rgb sky(int row, int height) {
  const double down = static_cast<double>(row) / height;
  const auto mix = [down](int top, int bottom) { return static_cast<std::uint8_t>(top + (bottom - top) * down); };
  return {mix(150, 225), mix(180, 230), mix(215, 235)};
}

/// Draws a disc whose middle is nearer than its rim. Where the discs of a surface overlap, each pixel then shows the
/// disc with the nearest middle.
void draw_disc(Canvas& canvas, double x, double y, double radius_px, double depth, double radius_m, Rgb colour) {
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
    const int dx = static_cast<int>(std::lround(r * std::cos(angle))),
              dy = static_cast<int>(std::lround(r * std::sin(angle)));
    if (dx == 0 && dy == 0) continue;
    const double turn = std::atan2(dy, dx) / (2 * std::numbers::pi) + 1.0 + 1.0 / 16;  // the axes lie inside a sector
    all.push_back({dx, dy, 1u << (static_cast<int>(turn * 8) % 8), 1.0f / static_cast<float>(dx * dx + dy * dy)});
  }
  return all;
}

/// Closes gaps. A pixel that is empty, or far behind the pixels all around it, lies between the points of a near
/// surface and takes their mean. Beside an edge the near pixels are on one side only, so surfaces do not grow.
void close_gaps(Canvas& canvas, double radius, int count) {
  constexpr int kDirectionsNeeded = 6;
  constexpr float kBehind = 1.12f;  // factor of the neighbour's depth
  const std::vector<Neighbour> neighbours = neighbours_within(radius, count);
  const Canvas before = canvas;
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

}  // namespace

std::string StreetViewConfig::validate() const {
  if (!position.allFinite() || !std::isfinite(heading) || !std::isfinite(pitch))
    return "position, heading and pitch must be numbers";
  if (!(horizontal_view >= 0.2 && horizontal_view <= 2.6)) return "horizontal_view must be from 0.2 to 2.6 rad";
  if (width < 16 || height < 16 || width > 10000 || height > 10000) return "width and height must be from 16 to 10000";
  if (!(nearest_m > 0 && farthest_m > nearest_m)) return "nearest_m must be above 0 and below farthest_m";
  if (!(splat_m >= 0.001 && splat_m <= 1)) return "splat_m must be from 0.001 to 1";
  if (!(splat_share >= 0 && splat_share <= 0.1)) return "splat_share must be from 0 to 0.1";
  return {};
}

Result<StreetView> picture_from_street(const std::filesystem::path& las, const StreetViewConfig& config) {
  if (std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  Result<LasReader> reader = LasReader::open(las);
  if (!reader) return reader.error();
  std::vector<LasPoint> points;
  // The first points show whether colours have 8 or 16 bits, and how bright the echoes are.
  std::uint16_t brightest_colour = 0, brightest_intensity = 0;
  if (Status read = reader->next(points, 200'000); !read) return read.error();
  for (const LasPoint& p : points) {
    brightest_colour = std::max({brightest_colour, p.red, p.green, p.blue});
    brightest_intensity = std::max(brightest_intensity, p.intensity);
  }
  const PointColour colour(*reader, brightest_colour < 256, brightest_intensity);

  // The picture is drawn with a margin, which is cut off again, so that pixels at its border have points all around
  // too.
  const double closing = std::max(6.0, config.width / 120.0);
  const int margin = static_cast<int>(std::ceil(closing));
  const int width = config.width + 2 * margin, height = config.height + 2 * margin;
  Canvas canvas{RgbImage(width, height, {}), {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) canvas.image.at(x, y) = sky(y, height);
  canvas.depth.assign(canvas.image.pixels.size(), kEmpty);

  const double focal = config.width / 2.0 / std::tan(config.horizontal_view / 2);
  const double ch = std::cos(config.heading), sh = std::sin(config.heading);
  const double cp = std::cos(config.pitch), sp = std::sin(config.pitch);
  const Eigen::Vector3d forward(sh * cp, ch * cp, sp), right(ch, -sh, 0), down = forward.cross(right);
  const double cx = (width - 1) / 2.0, cy = (height - 1) / 2.0;
  reader->rewind();
  Status cut;
  while (true) {
    const Status read = reader->next(points);
    if (!read && read.error().code != ErrorCode::Truncated) return read.error();
    if (!read) cut = read;
    if (!read || points.empty()) break;  // a cut cloud ends early
    for (const LasPoint& p : points) {
      const Eigen::Vector3d d(p.x - config.position.x(), p.y - config.position.y(), p.z - config.position.z());
      const double depth = d.dot(forward);
      if (!(depth >= config.nearest_m && depth <= config.farthest_m)) continue;
      const double x = cx + focal * d.dot(right) / depth, y = cy + focal * d.dot(down) / depth;
      const double radius_m = std::max(config.splat_m, config.splat_share * depth);
      const double radius_px = std::min(focal * radius_m / depth, config.width / 20.0);
      if (x < -radius_px || y < -radius_px || x > width + radius_px || y > height + radius_px) continue;
      draw_disc(canvas, x, y, radius_px, depth, radius_m, colour(p));
    }
  }
  close_gaps(canvas, 3.5, 48);
  close_gaps(canvas, closing, 96);
  StreetView view{RgbImage(config.width, config.height, {}), cut};
  for (int y = 0; y < config.height; ++y)
    for (int x = 0; x < config.width; ++x) view.image.at(x, y) = canvas.image.at(x + margin, y + margin);
  return view;
}

}  // namespace hueline::storage
