#include "calibration/targets/survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

namespace hueline::calibration {
namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> out;
  for (;;) {
    const std::size_t end = line.find(separator);
    out.push_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return out;
    line.remove_prefix(end + 1);
  }
}

Error refused(const std::string& where, const std::string& what) { return {ErrorCode::Invalid, where + ": " + what}; }

/// Says what is wrong with a column's name: mostly its unit.
std::string advice(std::string_view column) {
  for (const std::string_view axis : {"east", "north", "up", "sigma", "radius"}) {
    if (!column.starts_with(axis)) continue;
    if (column == axis) return fmt::format("the column '{0}' does not say its unit; if it holds metres name it {0}_m", column);
    return fmt::format("the column '{}' is not in metres; convert its values and name it {}_m", column, axis);
  }
  if (column == "x" || column == "y" || column == "z" || column.starts_with("x_") || column.starts_with("y_") || column.starts_with("z_"))
    return fmt::format("the column '{}' does not say which axis it is; name it east_m, north_m or up_m", column);
  if (column.starts_with("lat") || column.starts_with("lon")) return fmt::format("the column '{}' is an angle; project the coordinates to metres first", column);
  return fmt::format("unknown column '{}'", column);
}

/// The rows of a CSV by column, checked for form.
class Table {
 public:
  static Result<Table> parse(const std::string& csv, const std::string& file, const std::vector<std::string>& must, const std::vector<std::string>& may) {
    Table table;
    std::size_t number = 0;
    std::string_view rest = csv;
    if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
    while (!rest.empty()) {
      const std::size_t end = rest.find('\n');
      const std::string_view line = trimmed(rest.substr(0, end));
      rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
      ++number;
      if (line.empty() || line.front() == '#') continue;
      const std::string where = fmt::format("{}:{}", file, number);
      if (line.find('"') != std::string_view::npos) return refused(where, "quoted values are not read; leave the quotes out");
      const auto values = split(line, ',');
      if (table.columns_.empty()) {
        if (values.size() == 1 && line.find(';') != std::string_view::npos) return refused(where, "values are parted by semicolons; part them by commas, with decimal points");
        for (std::size_t i = 0; i < values.size(); ++i) {
          const std::string column(values[i]);
          if (std::ranges::find(must, column) == must.end() && std::ranges::find(may, column) == may.end())
            return refused(where, fmt::format("{}. Columns: {}; may have {}", advice(column), fmt::join(must, ", "), fmt::join(may, ", ")));
          if (!table.columns_.emplace(column, i).second) return refused(where, fmt::format("the column '{}' stands twice", column));
        }
        for (const auto& column : must)
          if (!table.columns_.contains(column)) return refused(where, fmt::format("the column '{}' is missing; the first line must name {}", column, fmt::join(must, ", ")));
        continue;
      }
      if (values.size() != table.columns_.size())
        return refused(where, fmt::format("{} values, the first line names {} columns", values.size(), table.columns_.size()));
      table.rows_.emplace_back(values.begin(), values.end());
      table.where_.push_back(where);
      const std::string& name = table.rows_.back()[table.columns_.at("name")];
      if (name.empty()) return refused(where, "an empty name");
      if (!table.names_.insert(name).second) return refused(where, fmt::format("the name '{}' stands twice", name));
    }
    if (table.rows_.empty()) return refused(file, "holds no rows");
    return table;
  }

  std::size_t rows() const { return rows_.size(); }
  bool has(const std::string& column) const { return columns_.contains(column); }
  const std::string& where(std::size_t row) const { return where_[row]; }
  std::string text(std::size_t row, const std::string& column) const { return has(column) ? rows_[row][columns_.at(column)] : std::string(); }

  Result<double> number(std::size_t row, const std::string& column) const {
    const std::string word = text(row, column);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      return refused(where_[row], fmt::format("{} is '{}', not a number", column, word));
    return value;
  }
  /// A number that may be left out, as a column or as an empty field.
  Result<std::optional<double>> optional_number(std::size_t row, const std::string& column) const {
    if (text(row, column).empty()) return std::optional<double>();
    const auto value = number(row, column);
    if (!value.ok()) return value.error();
    return std::optional<double>(*value);
  }
  Result<Point<Survey>> position(std::size_t row) const {
    Point<Survey> p;
    const char* axes[] = {"east_m", "north_m", "up_m"};
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = number(row, axes[axis]);
      if (!value.ok()) return value.error();
      // Nothing projected on Earth is farther from its origin than half the equator.
      if (std::abs(*value) > 2.1e7) return refused(where_[row], fmt::format("{} is {} m: no place on Earth; are the values in millimetres?", axes[axis], *value));
      p.xyz[axis] = *value;
    }
    // The deepest mine and the highest mountain with room to spare: beyond them the axes stand in another order.
    if (std::abs(p.xyz.z()) > 12000)
      return refused(where_[row], fmt::format("up_m is {} m: no height on Earth; are the axes swapped, or the values in millimetres?", p.xyz.z()));
    return p;
  }

 private:
  std::map<std::string, std::size_t> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::string> where_;
  std::set<std::string> names_;
};

Result<double> sigma_of(const Table& table, std::size_t row, double otherwise) {
  const auto given = table.optional_number(row, "sigma_m");
  if (!given.ok()) return given.error();
  const double sigma = given->value_or(otherwise);
  if (!(sigma > 0 && sigma <= 10)) return refused(table.where(row), fmt::format("sigma_m is {}; allowed: above 0, up to 10", sigma));
  return sigma;
}

}  // namespace

Result<std::vector<SurveyedTarget>> parse_targets(const std::string& csv, const std::string& file, const SurveyDefaults& defaults) {
  const auto table = Table::parse(csv, file, {"name", "east_m", "north_m", "up_m"}, {"sigma_m", "radius_m", "role", "stations"});
  if (!table.ok()) return table.error();
  std::vector<SurveyedTarget> out;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const std::string& where = table->where(row);
    SurveyedTarget target;
    target.name = table->text(row, "name");
    const auto position = table->position(row);
    if (!position.ok()) return position.error();
    target.position = *position;
    const auto sigma = sigma_of(*table, row, defaults.target_sigma_m);
    if (!sigma.ok()) return sigma.error();
    target.sigma_m = *sigma;
    const auto radius = table->optional_number(row, "radius_m");
    if (!radius.ok()) return radius.error();
    target.radius_m = radius->value_or(defaults.radius_m);
    if (target.radius_m == 0) return refused(where, "no radius: add the column radius_m, or give one radius for all targets");
    if (!(target.radius_m >= 0.01 && target.radius_m <= 1)) return refused(where, fmt::format("radius_m is {}; allowed: 0.01 to 1 (a radius, in metres)", target.radius_m));
    const std::string role = table->text(row, "role");
    if (!role.empty() && role != "orientation" && role != "check") return refused(where, fmt::format("role is '{}'; allowed: orientation, check", role));
    target.is_check = role == "check";
    const std::string names = table->text(row, "stations");
    for (const auto word : split(names, ' '))
      if (!word.empty()) target.stations.emplace_back(word);
    for (const SurveyedTarget& other : out)
      if ((other.position.xyz - target.position.xyz).norm() < other.radius_m + target.radius_m)
        return refused(where, fmt::format("{} stands inside {}: {:.3f} m apart", target.name, other.name, (other.position.xyz - target.position.xyz).norm()));
    out.push_back(std::move(target));
  }
  return out;
}

Result<std::vector<SurveyedStation>> parse_stations(const std::string& csv, const std::string& file) {
  const auto table = Table::parse(csv, file, {"name", "east_m", "north_m", "up_m"}, {"sigma_m", "scan"});
  if (!table.ok()) return table.error();
  std::vector<SurveyedStation> out;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    SurveyedStation station;
    station.name = table->text(row, "name");
    if (station.name.find(' ') != std::string::npos) return refused(table->where(row), "a station's name must have no spaces");
    const auto position = table->position(row);
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
