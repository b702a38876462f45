#include <algorithm>
#include <cmath>

#include "core/portable_math.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/cloud_picture.hpp"
#include "storage/point_canvas.hpp"
#include "storage/point_colour.hpp"

namespace hueline::storage {
namespace {

/// Returns what is drawn where no point is: the sky, and below the horizon a grey that is not taken for snow.
Rgb backdrop(int row, int height, double horizon) {
  constexpr Rgb kGround{84, 85, 87};
  if (row > horizon) return kGround;
  const double down = static_cast<double>(row) / height;
  const auto mix = [down](int top, int bottom) { return static_cast<std::uint8_t>(top + (bottom - top) * down); };
  return {mix(150, 225), mix(180, 230), mix(215, 235)};
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
  const Result<CrsInMetres> metric = crs_in_metres(*reader);
  if (!metric) return Error{metric.error().code, las.string() + ": " + metric.error().message};
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
  PointCanvas canvas(width, height);
  const double focal = config.width / 2.0 / portable::tan(config.horizontal_view / 2);
  const double horizon = 0.5 * (height - 1) + focal * portable::tan(std::clamp(config.pitch, -1.5, 1.5));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) canvas.image.at(x, y) = backdrop(y, height, horizon);
  const PointView view_of(config.position, config.heading, config.pitch, focal, width, height);
  reader->rewind();
  Status cut;
  while (true) {
    const Status read = reader->next(points);
    if (!read && read.error().code != ErrorCode::Truncated) return read.error();
    if (!read) cut = read;
    if (!read || points.empty()) break;  // a cut cloud ends early
    for (const LasPoint& p : points) {
      const auto seen = view_of.project(metric->place(p));
      if (!(seen.depth >= config.nearest_m && seen.depth <= config.farthest_m)) continue;
      const double radius_m = std::max(config.splat_m, config.splat_share * seen.depth);
      const double radius_px = std::min(focal * radius_m / seen.depth, config.width / 20.0);
      if (seen.x < -radius_px || seen.y < -radius_px || seen.x > width + radius_px || seen.y > height + radius_px)
        continue;
      draw_disc(canvas, seen.x, seen.y, radius_px, seen.depth, radius_m, colour(p));
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
