#include "survey/panorama_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "core/angle.hpp"
#include "core/csv_table.hpp"
#include "core/utc_text.hpp"

namespace hueline::survey {
namespace {

constexpr std::array kColumns{"file",
                              "exposure",
                              "gps_s",
                              "utc",
                              "latitude_deg",
                              "longitude_deg",
                              "ellipsoidal_height_m",
                              "sigma_horizontal_m",
                              "sigma_up_m",
                              "heading_deg",
                              "pitch_deg",
                              "roll_deg",
                              "head_heading_deg",
                              "points",
                              "seen_share",
                              "filled_share",
                              "width_px",
                              "height_px",
                              "forward_px",
                              "clockwise",
                              "q_head_view_w",
                              "q_head_view_x",
                              "q_head_view_y",
                              "q_head_view_z",
                              "easting_",  // the unit of the map follows
                              "northing_",
                              "height_",
                              "pixels_are_gravity_aligned"};

}  // namespace

std::string panorama_table_head(const std::string& unit, const std::string& up_unit) {
  std::string out;
  for (const std::string_view column : kColumns) {
    out += out.empty() ? "" : ",";
    out += column;
    if (column.ends_with('_')) out += column == "height_" ? up_unit : unit;
  }
  return out + "\n";
}

std::string panorama_table_line(const DrivePanorama& one, const std::string& name, const Eigen::Vector3d& place) {
  const auto& shape = one.view.shape;
  const Eigen::Quaterniond& q = one.view.R_head_view;
  return fmt::format(
      "{},{},{:.6f},{},{:.10f},{:.10f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{:.4f},{:.4f},{},{},{:.4f},{"
      "},"
      "{:.10f},{:.10f},{:.10f},{:.10f},{:.4f},{:.4f},{:.4f},{}\n",
      name, one.exposure, static_cast<double>(count_ns(one.time) / 1000) * 1e-6, utc_text(one.time),
      one.centre.latitude / kRadPerDeg, one.centre.longitude / kRadPerDeg, one.centre.ellipsoidal_height,
      one.sigma_horizontal_m, one.sigma_up_m, one.heading / kRadPerDeg, one.pitch / kRadPerDeg, one.roll / kRadPerDeg,
      one.head_heading / kRadPerDeg, one.points, one.rendered.seen_share, one.rendered.filled_share, shape.width,
      shape.height, shape.forward(), shape.is_clockwise ? 1 : 0, q.w(), q.x(), q.y(), q.z(), place.x(), place.y(),
      place.z(), one.is_level ? 1 : 0);
}

Result<std::map<std::uint32_t, ListedPanorama>> parse_panorama_table(const std::string& text, const std::string& file) {
  CsvTable::Columns columns{.needed = {"exposure", "width_px", "height_px", "forward_px", "clockwise", "q_head_view_w",
                                       "q_head_view_x", "q_head_view_y", "q_head_view_z"},
                            .allowed = {},
                            .units = {},
                            .advice = {}};
  for (const std::string column : kColumns) {
    if (column.ends_with('_'))
      for (const char* unit : {"m", "ft", "ftUS"}) columns.allowed.push_back(column + unit);
    else if (std::find(columns.needed.begin(), columns.needed.end(), column) == columns.needed.end())
      columns.allowed.push_back(column);
  }
  const auto table = CsvTable::parse(text, file, columns);
  if (!table.ok()) return table.error();
  std::map<std::uint32_t, ListedPanorama> out;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    std::array<std::uint32_t, 4> whole;
    for (std::size_t i = 0; const char* column : {"exposure", "width_px", "height_px", "clockwise"}) {
      const auto value = table->whole_number(row, column);
      if (!value.ok()) return value.error();
      whole[i++] = *value;
    }
    std::array<double, 5> numbers;
    for (std::size_t i = 0;
         const char* column : {"forward_px", "q_head_view_w", "q_head_view_x", "q_head_view_y", "q_head_view_z"}) {
      const auto value = table->number(row, column);
      if (!value.ok()) return value.error();
      numbers[i++] = *value;
    }
    const auto gps_s = table->optional_number(row, "gps_s");
    if (!gps_s.ok()) return gps_s.error();
    ListedPanorama listed;
    if (*gps_s) listed.time = gps_time_ns(std::llround(**gps_s * 1e9));
    fusion::PanoramaView& view = listed.view;
    view.shape.width = whole[1];
    view.shape.height = whole[2];
    view.shape.is_clockwise = whole[3] != 0;
    view.shape.forward_column = numbers[0];
    view.R_head_view = Eigen::Quaterniond(numbers[1], numbers[2], numbers[3], numbers[4]);
    if (std::abs(view.R_head_view.norm() - 1) > 1e-6)
      return table->refuse(row, "q_head_view_w, _x, _y, _z are no rotation: the sum of their squares is not 1");
    if (whole[1] == 0 || whole[1] != 2 * whole[2]) return table->refuse(row, "width_px is not twice height_px");
    view.R_head_view.normalize();
    if (!out.emplace(whole[0], listed).second)
      return table->refuse(row, fmt::format("exposure {} is there twice", whole[0]));
  }
  return out;
}

}  // namespace hueline::survey
