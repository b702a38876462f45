#include "fusion/single_shot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {

/// The nearest distance in each cell of a grid over the image.
class NearestGrid {
 public:
  NearestGrid(std::uint32_t width, std::uint32_t height, double cell_px)
      : cell_px_(cell_px),
        columns_(static_cast<int>(width / cell_px) + 1),
        rows_(static_cast<int>(height / cell_px) + 1),
        nearest_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_),
                 std::numeric_limits<float>::infinity()) {}

  void add(const ShotPoint& p) {
    float& nearest = nearest_[index(column(p), row(p))];
    nearest = std::min(nearest, p.distance_m);
  }
  float around(const ShotPoint& p) const {
    float nearest = std::numeric_limits<float>::infinity();
    for (int r = std::max(0, row(p) - 1); r <= std::min(rows_ - 1, row(p) + 1); ++r) {
      for (int c = std::max(0, column(p) - 1); c <= std::min(columns_ - 1, column(p) + 1); ++c) {
        nearest = std::min(nearest, nearest_[index(c, r)]);
      }
    }
    return nearest;
  }

 private:
  int column(const ShotPoint& p) const { return static_cast<int>(p.u / cell_px_); }
  int row(const ShotPoint& p) const { return static_cast<int>(p.v / cell_px_); }
  std::size_t index(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c);
  }

  double cell_px_;
  int columns_, rows_;
  std::vector<float> nearest_;
};

/// Returns a colour from red (near) over yellow, green and blue to violet (far); `share` is 0 to 1.
std::array<std::uint8_t, 3> rainbow(double share) {
  const double hue = 4.6 * std::clamp(share, 0.0, 1.0);  // in sectors, of which there are six
  const auto channel = [hue](double centre) {
    const double away = std::abs(std::remainder(hue - centre, 6.0));
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(2.0 - away, 0.0, 1.0)));
  };
  return {channel(0.0), channel(2.0), channel(4.0)};
}

RgbRaster backdrop(const RawView& image) {
  RgbRaster raster{image.width, image.height, {}};
  raster.pixels.resize(3 * static_cast<std::size_t>(image.width) * image.height);
  std::uint8_t* out = raster.pixels.data();
  for (std::uint32_t y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.data + y * image.stride;
    for (std::uint32_t x = 0; x < image.width; ++x, out += 3) {
      int grey = row[x];
      if (image.format == PixelFormat::Rgb8) grey = (77 * row[3 * x] + 150 * row[3 * x + 1] + 29 * row[3 * x + 2]) >> 8;
      out[0] = out[1] = out[2] = static_cast<std::uint8_t>(grey * 3 / 4);
    }
  }
  return raster;
}

}  // namespace

std::string SingleShotConfig::validate() const {
  if (!(visibility_cell_px >= 1 && visibility_cell_px <= 1000)) {
    return fmt::format("visibility_cell_px is {}; allowed: 1 to 1000 px", visibility_cell_px);
  }
  if (!(depth_share >= 0 && depth_share <= 10)) return fmt::format("depth_share is {}; allowed: 0 to 10", depth_share);
  if (!(depth_margin_m >= 0 && depth_margin_m <= 1000))
    return fmt::format("depth_margin_m is {}; allowed: 0 to 1000 m", depth_margin_m);
  return {};
}

std::vector<ShotPoint> colour_single_shot(std::span<const Point<Scanner>> points,
                                          const Transform<Lens, Scanner>& T_lens_scanner, const CameraModel& model,
                                          const RawView& image, const SingleShotConfig& config) {
  std::vector<ShotPoint> shots(points.size());
  NearestGrid grid(model.intrinsics().width, model.intrinsics().height, config.visibility_cell_px);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point<Lens> p_lens = T_lens_scanner * points[i];
    const auto pixel = model.project(p_lens);
    ShotPoint& shot = shots[i];
    shot.distance_m = static_cast<float>(p_lens.xyz.norm());
    if (!pixel || !model.in_image(*pixel, kSampleReach)) continue;
    shot.is_in_image = true;
    shot.u = static_cast<float>(pixel->x());
    shot.v = static_cast<float>(pixel->y());
    grid.add(shot);
  }
  const bool has_pixels =
      image.data != nullptr && image.width >= model.intrinsics().width && image.height >= model.intrinsics().height;
  for (ShotPoint& shot : shots) {
    if (!shot.is_in_image) continue;
    if (config.test_visibility) {
      const double nearest = grid.around(shot);
      shot.is_hidden = shot.distance_m > nearest * (1.0 + config.depth_share) + config.depth_margin_m;
    }
    if (shot.is_hidden || !has_pixels) continue;
    const auto x = static_cast<int>(shot.u), y = static_cast<int>(shot.v);
    const Rgb colour = sample(image, x, y, shot.u - static_cast<float>(x), shot.v - static_cast<float>(y));
    shot.red = static_cast<std::uint8_t>(colour.red + 0.5f);
    shot.green = static_cast<std::uint8_t>(colour.green + 0.5f);
    shot.blue = static_cast<std::uint8_t>(colour.blue + 0.5f);
    shot.state = ColourState::Direct;
  }
  return shots;
}

RgbRaster draw_points(std::span<const ShotPoint> points, const RawView& image, const PointDrawing& drawing) {
  if (image.data == nullptr) return {};
  RgbRaster raster = backdrop(image);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].is_in_image && (drawing.draw_hidden || !points[i].is_hidden)) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return points[a].distance_m > points[b].distance_m; });
  const double scale = 1.0 / portable::log(drawing.far_m / drawing.near_m);
  const int half = drawing.size_px / 2;
  for (const std::size_t i : order) {
    const ShotPoint& p = points[i];
    const auto colour =
        rainbow(portable::log(std::max(static_cast<double>(p.distance_m), 1e-3) / drawing.near_m) * scale);
    const int u = static_cast<int>(std::lround(p.u)), v = static_cast<int>(std::lround(p.v));
    for (int y = std::max(0, v - half); y <= std::min(static_cast<int>(raster.height) - 1, v + half); ++y) {
      for (int x = std::max(0, u - half); x <= std::min(static_cast<int>(raster.width) - 1, u + half); ++x) {
        std::copy(colour.begin(), colour.end(),
                  raster.pixels.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * raster.width + x));
      }
    }
  }
  return raster;
}

}  // namespace hueline::fusion
