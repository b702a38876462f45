#include "calibration/targets/survey.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/csv_table.hpp"

namespace hueline::calibration {
namespace {

/// Returns what is wrong with the name of a column, which is mostly its unit.
std::string advice(std::string_view column) {
  for (const std::string_view axis : {"east", "north", "up", "sigma", "radius"}) {
    if (!column.starts_with(axis)) continue;
    if (column == axis)
      return fmt::format("column '{0}' does not say its unit; if it holds metres name it {0}_m", column);
    if (column.ends_with("_m")) return fmt::format("column '{}' is unknown; name it {}_m", column, axis);
    return fmt::format("column '{}' is not in metres; convert its values and name it {}_m", column, axis);
  }
  if (column == "x" || column == "y" || column == "z" || column.starts_with("x_") || column.starts_with("y_") ||
      column.starts_with("z_"))
    return fmt::format("column '{}' does not say which axis it is; name it east_m, north_m or up_m", column);
  if (column.starts_with("lat") || column.starts_with("lon"))
    return fmt::format("column '{}' is an angle; project the coordinates to metres first", column);
  return {};
}

/// Reads a table in which every row has a name of its own.
Result<CsvTable> parse(const std::string& csv, const std::string& file, std::vector<std::string> allowed) {
  auto table = CsvTable::parse(
      csv, file,
      {.needed = {"name", "east_m", "north_m", "up_m"}, .allowed = std::move(allowed), .units = {}, .advice = advice});
  if (!table.ok()) return table;
  std::set<std::string> names;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const std::string& name = table->text(row, "name");
    if (name.empty()) return table->refuse(row, "an empty name");
    if (!names.insert(name).second) return table->refuse(row, fmt::format("the name '{}' stands twice", name));
  }
  return table;
}

Result<Point<Survey>> position_of(const CsvTable& table, std::size_t row) {
  Point<Survey> p;
  const char* axes[] = {"east_m", "north_m", "up_m"};
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = table.number(row, axes[axis]);
    if (!value.ok()) return value.error();
    // No projected coordinate on Earth is farther from its origin than half the equator.
    if (std::abs(*value) > 2.1e7)
      return table.refuse(
          row, fmt::format("{} is {} m: no place on Earth; are the values in millimetres?", axes[axis], *value));
    p.xyz[axis] = *value;
  }
  // The limit includes the deepest mine and the highest mountain. Larger heights mean that the axes are in another
  // order.
  if (std::abs(p.xyz.z()) > 12000)
    return table.refuse(
        row, fmt::format("up_m is {} m: no height on Earth; are the axes swapped, or the values in millimetres?",
                         p.xyz.z()));
  return p;
}

Result<double> sigma_of(const CsvTable& table, std::size_t row, double otherwise) {
  const auto given = table.optional_number(row, "sigma_m");
  if (!given.ok()) return given.error();
  const double sigma = given->value_or(otherwise);
  if (!(sigma > 0 && sigma <= 10))
    return table.refuse(row, fmt::format("sigma_m is {}; allowed: above 0, up to 10", sigma));
  return sigma;
}

}  // namespace

Result<std::vector<SurveyedTarget>> parse_targets(const std::string& csv, const std::string& file,
                                                  const SurveyDefaults& defaults) {
  const auto table = parse(csv, file, {"sigma_m", "radius_m", "role", "stations"});
  if (!table.ok()) return table.error();
  std::vector<SurveyedTarget> out;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    SurveyedTarget target;
    target.name = table->text(row, "name");
    const auto position = position_of(*table, row);
    if (!position.ok()) return position.error();
    target.position = *position;
    const auto sigma = sigma_of(*table, row, defaults.target_sigma_m);
    if (!sigma.ok()) return sigma.error();
    target.sigma_m = *sigma;
    const auto radius = table->optional_number(row, "radius_m");
    if (!radius.ok()) return radius.error();
    target.radius_m = radius->value_or(defaults.radius_m);
    if (target.radius_m == 0)
      return table->refuse(row, "no radius: add the column radius_m, or give one radius for all targets");
    if (!(target.radius_m >= 0.01 && target.radius_m <= 1))
      return table->refuse(row,
                           fmt::format("radius_m is {}; allowed: 0.01 to 1 (a radius, in metres)", target.radius_m));
    const std::string role = table->text(row, "role");
    if (!role.empty() && role != "orientation" && role != "check")
      return table->refuse(row, fmt::format("role is '{}'; allowed: orientation, check", role));
    target.is_check = role == "check";
    std::istringstream names(table->text(row, "stations"));
    for (std::string name; names >> name;) target.stations.push_back(name);
    for (const SurveyedTarget& other : out)
      if ((other.position.xyz - target.position.xyz).norm() < other.radius_m + target.radius_m)
        return table->refuse(row, fmt::format("{} stands inside {}: {:.3f} m apart", target.name, other.name,
                                              (other.position.xyz - target.position.xyz).norm()));
    out.push_back(std::move(target));
  }
  return out;
}

Result<std::vector<SurveyedStation>> parse_stations(const std::string& csv, const std::string& file) {
  const auto table = parse(csv, file, {"sigma_m", "scan"});
  if (!table.ok()) return table.error();
  std::vector<SurveyedStation> out;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    SurveyedStation station;
    station.name = table->text(row, "name");
    if (station.name.find(' ') != std::string::npos) return table->refuse(row, "a station's name must have no spaces");
    const auto position = position_of(*table, row);
    if (!position.ok()) return position.error();
    station.position = *position;
    if (!table->text(row, "sigma_m").empty()) {
      const auto sigma = sigma_of(*table, row, 0);
      if (!sigma.ok()) return sigma.error();
      station.sigma_m = *sigma;
    }
    station.scan = table->text(row, "scan");
    out.push_back(std::move(station));
  }
  return out;
}

}  // namespace hueline::calibration
