#include <algorithm>
#include <cmath>
#include <limits>

#include "storage/cloud_crs.hpp"
#include "storage/cloud_picture.hpp"
#include "storage/drawing.hpp"
#include "storage/point_colour.hpp"

namespace hueline::storage {
namespace {

constexpr Rgb kBackground{24, 26, 30};
constexpr Rgb kInk{255, 255, 255};
constexpr Rgb kPanel{40, 44, 52};

/// The result of the first reading.
struct Survey {
  std::vector<float> east, north;  // of a sample of the points, from `base`
  double base_east = 0, base_north = 0;
  std::uint64_t points = 0;
  std::uint16_t brightest_colour = 0, brightest_intensity = 0;
};

Result<Survey> survey(LasReader& reader) {
  Survey s;
  const std::uint64_t every = std::max<std::uint64_t>(1, reader.header().point_count / 500'000);
  std::vector<LasPoint> points;
  while (true) {
    if (Status read = reader.next(points); !read) {
      if (read.error().code == ErrorCode::Truncated && s.points > 0) break;  // show the points that are there
      return read.error();
    }
    if (points.empty()) break;
    for (const LasPoint& p : points) {
      if (s.points == 0) s.base_east = p.x, s.base_north = p.y;
      if (s.points++ % every == 0) {
        s.east.push_back(static_cast<float>(p.x - s.base_east));
        s.north.push_back(static_cast<float>(p.y - s.base_north));
      }
      s.brightest_colour = std::max({s.brightest_colour, p.red, p.green, p.blue});
      s.brightest_intensity = std::max(s.brightest_intensity, p.intensity);
    }
  }
  if (s.points == 0) return Error{ErrorCode::Invalid, "a cloud without points has no picture"};
  return s;
}

/// Returns the values below and above which `share` of the sample lies, with a margin.
std::pair<double, double> span_without(std::vector<float> values, double share) {
  const auto skip = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  const auto low = values.begin() + static_cast<std::ptrdiff_t>(skip);
  std::nth_element(values.begin(), low, values.end());
  const double from = *low;
  const auto high = values.end() - 1 - static_cast<std::ptrdiff_t>(skip);
  std::nth_element(values.begin(), high, values.end());
  const double to = *high;
  const double margin = 0.02 * (to - from) + 0.5;
  return {from - margin, to + margin};
}

/// Returns the largest of 1, 2 and 5 times a power of ten that is not above x, which is more than 0.
double round_length(double x) {
  double power = 1;
  while (10 * power <= x) power *= 10;
  while (power > x) power /= 10;
  for (const double step : {5.0, 2.0})
    if (step * power <= x) return step * power;
  return power;
}

struct Cell {
  float height = -std::numeric_limits<float>::infinity();
  bool coloured = false;
};

/// Gives empty cells between filled ones the mean of their neighbours.
void close_gaps(RgbImage& image, std::vector<Cell>& cells) {
  for (int round = 0; round < 2; ++round) {
    const RgbImage before = image;
    const std::vector<Cell> known = cells;
    for (int y = 1; y + 1 < image.height; ++y)
      for (int x = 1; x + 1 < image.width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * image.width + x;
        if (std::isfinite(known[i].height)) continue;
        int count = 0, sum[3] = {0, 0, 0};
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const std::size_t j = static_cast<std::size_t>(y + dy) * image.width + (x + dx);
            if (!std::isfinite(known[j].height)) continue;
            ++count;
            for (std::size_t k = 0; k < 3; ++k) sum[k] += before.pixels[j][k];
          }
        if (count < 4) continue;
        for (std::size_t k = 0; k < 3; ++k) image.pixels[i][k] = static_cast<std::uint8_t>(sum[k] / count);
        cells[i].height = 0;
      }
  }
}

void draw_scale_bar(TopView& view) {
  RgbImage& image = view.image;
  const int size = std::max(1, std::max(image.width, image.height) / 700);  // pixels of a dot
  view.scale_bar_m = round_length(0.25 * image.width * view.cell_m);
  const int length = static_cast<int>(std::lround(view.scale_bar_m / view.cell_m));
  const bool km = view.scale_bar_m >= 1000;
  std::string label = std::to_string(km ? view.scale_bar_m / 1000 : view.scale_bar_m);
  label.erase(label.find_last_not_of('0') + 1);
  if (label.back() == '.') label.pop_back();
  label += km ? " km" : " m";
  const int panel_height = 22 * size, margin = 6 * size;
  const int top = image.height - panel_height - margin;
  const int panel_width = std::max(length, text_width(label, size)) + 2 * margin;
  fill_rectangle(image, margin, top, panel_width, panel_height, kPanel);
  draw_text(image, 2 * margin, top + 3 * size, label, size, kInk);
  fill_rectangle(image, 2 * margin, top + 14 * size, length, 3 * size, kInk);
}

void draw_north_arrow(RgbImage& image) {
  const int size = std::max(1, std::max(image.width, image.height) / 700);
  const int margin = 6 * size, width = 24 * size, height = 44 * size, left = image.width - width - margin;
  fill_rectangle(image, left, margin, width, height, kPanel);
  const double middle = left + width / 2.0, top = margin + 4.0 * size, bottom = margin + 28.0 * size;
  fill_triangle(image, {{{middle, top}, {middle - 7.0 * size, bottom}, {middle + 7.0 * size, bottom}}}, kInk);
  draw_text(image, static_cast<int>(middle) - text_width("N", size) / 2, margin + 33 * size, "N", size, kInk);
}

}  // namespace

std::string TopViewConfig::validate() const {
  if (longest_side_px < 100 || longest_side_px > 20000) return "longest_side_px must be from 100 to 20000";
  if (!(cut_share >= 0 && cut_share <= 0.2)) return "cut_share must be from 0 to 0.2";
  return {};
}

Result<TopView> picture_from_above(const std::filesystem::path& las, const TopViewConfig& config) {
  if (std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  Result<LasReader> reader = LasReader::open(las);
  if (!reader) return reader.error();
  const Result<CrsUnit> unit = crs_unit(*reader);
  if (!unit) return unit.error();
  if (unit->is_angle)
    return Error{ErrorCode::Unsupported,
                 las.string() + ": its coordinates are longitude and latitude; a picture from above needs a map's"};
  Result<Survey> found = survey(*reader);
  if (!found) return found.error();
  const auto [west, east] = span_without(found->east, config.cut_share);
  const auto [south, north] = span_without(found->north, config.cut_share);

  TopView view;
  const double cell = std::max(east - west, north - south) / config.longest_side_px;
  view.cell_m = cell * unit->metres;
  view.west = found->base_east + west;
  view.north = found->base_north + north;
  const auto cells_along = [&](double length) { return std::max(1, static_cast<int>(std::lround(length / cell))); };
  // The picture is never so narrow that arrow and bar do not fit.
  const int width = std::max(cells_along(east - west), config.longest_side_px / 4);
  const int height = std::max(cells_along(north - south), config.longest_side_px / 4);
  view.west -= (width - cells_along(east - west)) / 2 * cell;
  view.north += (height - cells_along(north - south)) / 2 * cell;
  view.image = RgbImage(width, height, kBackground);

  const PointColour colour(*reader, found->brightest_colour < 256, found->brightest_intensity);
  std::vector<Cell> cells(view.image.pixels.size());
  reader->rewind();
  std::vector<LasPoint> points;
  while (true) {
    const Status read = reader->next(points);
    if (!read && read.error().code != ErrorCode::Truncated) return read.error();
    if (!read) view.read = read;
    if (!read || points.empty()) break;  // a cut cloud ends early
    for (const LasPoint& p : points) {
      const double column = std::floor((p.x - view.west) / cell), row = std::floor((view.north - p.y) / cell);
      if (!(column >= 0 && row >= 0 && column < width && row < height)) continue;
      const std::size_t i =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
      const bool coloured = colour.is_coloured(p);
      const auto z = static_cast<float>(p.z);
      if (coloured < cells[i].coloured || (coloured == cells[i].coloured && z <= cells[i].height)) continue;
      cells[i] = {z, coloured};
      view.image.pixels[i] = colour(p);
    }
  }
  close_gaps(view.image, cells);
  draw_scale_bar(view);
  draw_north_arrow(view.image);
  return view;
}

}  // namespace hueline::storage
