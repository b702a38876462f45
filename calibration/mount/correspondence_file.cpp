#include "calibration/mount/correspondence_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <sstream>

namespace hueline::calibration {
namespace {

constexpr double kFarthest_m = 1500;

std::vector<std::string> cells_of(const std::string& line, char separator) {
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, separator);) {
    const auto from = cell.find_first_not_of(" \t"), to = cell.find_last_not_of(" \t");
    out.push_back(from == std::string::npos ? "" : cell.substr(from, to - from + 1));
  }
  if (!line.empty() && line.back() == separator) out.emplace_back();
  return out;
}

Error refuse(const std::string& file, int line, const std::string& why) { return {ErrorCode::Malformed, fmt::format("{}:{}: {}", file, line, why)}; }

}  // namespace

Result<std::vector<LensCorrespondences>> parse_correspondences(const std::string& text, const std::string& file) {
  const std::vector<std::string> needed = {"u_px", "v_px", "x_m", "y_m", "z_m"};
  std::map<std::string, std::size_t> columns;
  std::vector<LensCorrespondences> out;
  std::istringstream in(text);
  char separator = ',';
  std::size_t width = 0;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);
    if (line.find_first_not_of(" \t") == std::string::npos || line[0] == '#') continue;
    if (columns.empty()) {
      if (line.find(';') != std::string::npos) separator = ';';
      const auto names = cells_of(line, separator);
      width = names.size();
      for (std::size_t i = 0; i < names.size(); ++i) {
        const bool is_known = names[i] == "name" || names[i] == "lens" || std::find(needed.begin(), needed.end(), names[i]) != needed.end();
        if (!is_known)
          return refuse(file, number, fmt::format("column '{}' is unknown; allowed: u_px, v_px, x_m, y_m, z_m (pixels and metres), name, lens", names[i]));
        if (!columns.emplace(names[i], i).second) return refuse(file, number, fmt::format("column '{}' is there twice", names[i]));
      }
      for (const auto& name : needed)
        if (!columns.contains(name)) return refuse(file, number, fmt::format("column '{}' is missing", name));
      continue;
    }
    const auto cells = cells_of(line, separator);
    if (cells.size() != width) return refuse(file, number, fmt::format("{} cells, the header has {}", cells.size(), width));
    double values[5];
    for (std::size_t i = 0; i < 5; ++i) {
      const std::string& cell = cells[columns[needed[i]]];
      const auto [end, wrong] = std::from_chars(cell.data(), cell.data() + cell.size(), values[i]);
      if (wrong != std::errc() || end != cell.data() + cell.size() || !std::isfinite(values[i]))
        return refuse(file, number, fmt::format("{} is '{}', not a number", needed[i], cell));
    }
    Correspondence point;
    point.name = columns.contains("name") ? cells[columns["name"]] : fmt::format("line {}", number);
    point.pixel = {values[0], values[1]};
    point.p_scanner = {values[2], values[3], values[4]};
    if (point.p_scanner.norm() > kFarthest_m)
      return refuse(file, number, fmt::format("the point is {:.0f} m from the scanner; are these millimetres, or coordinates of a map?", point.p_scanner.norm()));
    if (point.p_scanner.norm() < 0.01) return refuse(file, number, "the point is in the scanner itself: a row that was never filled in?");
    const std::string lens = columns.contains("lens") ? cells[columns["lens"]] : "";
    auto place = std::find_if(out.begin(), out.end(), [&](const LensCorrespondences& one) { return one.lens == lens; });
    if (place == out.end()) place = out.insert(out.end(), LensCorrespondences{lens, {}});
    place->points.push_back(std::move(point));
  }
  if (columns.empty()) return refuse(file, std::max(number, 1), "no header line");
  if (out.empty()) return refuse(file, number, "no points");
  return out;
}

}  // namespace hueline::calibration
