#include "calibration/mount/correspondence_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "core/csv_table.hpp"

namespace hueline::calibration {
namespace {

constexpr double kFarthest_m = 1500, kNearest_m = 0.01;

}  // namespace

Result<std::vector<LensCorrespondences>> parse_correspondences(const std::string& text, const std::string& file) {
  const CsvTable::Columns columns{.needed = {"u_px", "v_px", "x_m", "y_m", "z_m"},
                                  .allowed = {"name", "lens"},
                                  .units = "(pixels and metres)",
                                  .advice = {}};
  const auto table = CsvTable::parse(text, file, columns);
  if (!table.ok()) return table.error();
  std::vector<LensCorrespondences> out;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    std::array<double, 5> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto value = table->number(row, columns.needed[i]);
      if (!value.ok()) return value.error();
      values[i] = *value;
    }
    Correspondence point;
    point.name = table->has("name") ? table->text(row, "name") : fmt::format("line {}", table->line(row));
    point.pixel = {values[0], values[1]};
    point.p_scanner = {values[2], values[3], values[4]};
    const double distance = point.p_scanner.norm();
    if (distance > kFarthest_m)
      return table->refuse(
          row, fmt::format("the point is {:.0f} m from the scanner; are these millimetres, or coordinates of a map?",
                           distance));
    if (distance < kNearest_m)
      return table->refuse(row, "the point is in the scanner itself: a row that was never filled in?");
    const std::string& lens = table->text(row, "lens");
    auto place = std::find_if(out.begin(), out.end(), [&](const LensCorrespondences& one) { return one.lens == lens; });
    if (place == out.end()) place = out.insert(out.end(), LensCorrespondences{lens, {}});
    place->points.push_back(std::move(point));
  }
  return out;
}

}  // namespace hueline::calibration
