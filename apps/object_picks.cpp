#include "apps/object_picks.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

namespace hueline::apps {
namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> out(1);
  for (const char c : line)
    if (c == ',')
      out.emplace_back();
    else if (c != ' ' && c != '\t' && c != '\r')
      out.back() += c;
  return out;
}

template <class T>
bool reads(const std::string& cell, T& value) {
  const auto [end, wrong] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return wrong == std::errc() && end == cell.data() + cell.size();
}

}  // namespace

Result<std::vector<ObjectPick>> parse_object_picks(const std::string& text, const std::string& file) {
  std::vector<ObjectPick> out;
  std::map<std::string, std::size_t> columns;
  std::istringstream in(text);
  int number = 0;
  const auto refuse = [&](const std::string& why) { return Error{ErrorCode::Malformed, fmt::format("{}:{}: {}", file, number, why)}; };
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (number == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const auto cells = cells_of(line);
    if (columns.empty()) {
      for (std::size_t i = 0; i < cells.size(); ++i) {
        if (cells[i] != "name" && cells[i] != "exposure" && cells[i] != "lens" && cells[i] != "u_px" && cells[i] != "v_px")
          return refuse(fmt::format("column '{}' is unknown; allowed: exposure, u_px, v_px, name, lens", cells[i]));
        if (!columns.emplace(cells[i], i).second) return refuse(fmt::format("column '{}' is there twice", cells[i]));
      }
      for (const char* needed : {"exposure", "u_px", "v_px"})
        if (!columns.contains(needed)) return refuse(fmt::format("column '{}' is missing", needed));
      continue;
    }
    if (cells.size() != columns.size()) return refuse(fmt::format("{} cells, the first line has {}", cells.size(), columns.size()));
    ObjectPick pick;
    pick.name = columns.contains("name") ? cells[columns["name"]] : fmt::format("line {}", number);
    if (columns.contains("lens")) pick.lens = cells[columns["lens"]];
    if (!reads(cells[columns["exposure"]], pick.exposure)) return refuse(fmt::format("exposure is '{}', not a whole number", cells[columns["exposure"]]));
    const std::string &u = cells[columns["u_px"]], &v = cells[columns["v_px"]];
    if (!reads(u, pick.pixel.x()) || !reads(v, pick.pixel.y()) || !pick.pixel.allFinite()) return refuse(fmt::format("u_px, v_px are '{}', '{}', not numbers", u, v));
    out.push_back(std::move(pick));
  }
  if (columns.empty()) return refuse("no header line");
  if (out.empty()) return refuse("nothing is picked");
  return out;
}

}  // namespace hueline::apps
