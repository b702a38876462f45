#include "drivers/velodyne/velodyne_angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/angle.hpp"
#include "core/input_file.hpp"
#include "core/number_word.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint64_t kMostCalibrationBytes = 1'000'000;
constexpr std::size_t kMostLasers = 256;
constexpr double kMovesLeast_m = 1e-4;  // smaller corrections are below the step of every distance

/// The keys of one laser with their values.
using LaserKeys = std::map<std::string, double, std::less<>>;

std::optional<double> number_in(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const std::optional<double> value = parse_number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Reads the list of lasers. The files have maps in braces or a line for each key; both are words that end with a
/// colon, each before its value, and a dash before each laser.
Result<std::vector<LaserKeys>> lasers_in(const std::string& path, std::string text) {
  std::vector<LaserKeys> out;
  std::istringstream lines(std::move(text));
  std::string line, key;
  bool is_in_list = false;
  for (int number = 1; std::getline(lines, line); ++number) {
    line.resize(std::min(line.size(), line.find('#')));
    std::ranges::replace_if(
        line, [](char c) { return c == '{' || c == '}' || c == ',' || c == '[' || c == ']'; }, ' ');
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (word == "-") {
        if (!is_in_list) continue;  // of another list
        if (out.size() == kMostLasers)
          return Error{ErrorCode::Malformed, fmt::format("{}:{}: more than {} lasers", path, number, kMostLasers)};
        out.emplace_back();
      } else if (word.ends_with(':')) {
        key = word.substr(0, word.size() - 1);
        is_in_list |= key == "lasers";
      } else if (!out.empty() && !key.empty()) {
        const auto value = number_in(word);
        if (!value && (key == "laser_id" || key.ends_with("_correction")))
          return Error{ErrorCode::Malformed, fmt::format("{}:{}: {} is no number: {}", path, number, key, word)};
        if (value) out.back().emplace(std::exchange(key, {}), *value);
      }
    }
  }
  const bool has_angles = !out.empty() && out.front().contains("vert_correction");
  if (!has_angles)
    return Error{ErrorCode::Unsupported, path + ": no list `lasers` with a vert_correction of each laser"};
  return out;
}

}  // namespace

Result<VelodyneCalibration> read_velodyne_calibration(const std::string& path) {
  auto text = read_input(path, kMostCalibrationBytes, "a calibration file");
  if (!text.ok()) return text.error();
  const auto lasers = lasers_in(path, std::move(text).value());
  if (!lasers.ok()) return lasers.error();
  const std::size_t count = lasers->size();
  VelodyneCalibration out;
  out.angles.file = path;
  out.angles.elevations_deg.resize(count);
  out.angles.azimuths_deg.resize(count);
  out.vertical_offset_mm.resize(count);
  std::vector<bool> is_known(count, false);
  for (std::size_t i = 0; i < count; ++i) {
    const LaserKeys& laser = (*lasers)[i];
    const auto value = [&](std::string_view key) {
      const auto found = laser.find(key);
      return found == laser.end() ? 0.0 : found->second;
    };
    const double id = value("laser_id");
    const bool is_place = laser.contains("laser_id") && id >= 0 && id < static_cast<double>(count) &&
                          id == std::floor(id) && !is_known[static_cast<std::size_t>(id)];
    if (!is_place || !laser.contains("vert_correction") || !laser.contains("rot_correction"))
      return Error{ErrorCode::Malformed,
                   fmt::format("{}: laser {} of the list: each has a laser_id of its own from 0 to {}, a "
                               "vert_correction and a rot_correction",
                               path, i + 1, count - 1)};
    const auto place = static_cast<std::size_t>(id);
    is_known[place] = true;
    out.angles.elevations_deg[place] = value("vert_correction") * kDegPerRad;
    out.angles.azimuths_deg[place] = -value("rot_correction") * kDegPerRad;  // the azimuth counts clockwise
    out.vertical_offset_mm[place] = value("vert_offset_correction") * 1e3;
    for (const char* key : {"horiz_offset_correction", "dist_correction", "dist_correction_x", "dist_correction_y"})
      out.moves_points |= std::abs(value(key)) > kMovesLeast_m;
  }
  return out;
}

std::string why_not_of(const VelodyneTable& table, const BeamAngles& angles) {
  std::vector<ModelAngles> models;
  for (const VelodyneModel model : kVelodyneModels)
    models.push_back({velodyne_table(model).name, angles_of(velodyne_table(model).lasers)});
  return why_not_of(
      {table.name, angles_of(table.lasers)}, models, angles,
      fmt::format("there are {} lasers, the model has {}", angles.elevations_deg.size(), table.lasers.size()));
}

std::string why_not_of(const VelodyneTable& table, const VelodyneCalibration& calibration) {
  if (std::string wrong = why_not_of(table, calibration.angles); !wrong.empty()) return wrong;
  if (!calibration.moves_points) return {};
  return fmt::format(
      "it corrects distances, or has beams that begin aside (dist_correction, horiz_offset_correction), which a {} "
      "does not need and which is not supported; give the file of this very scanner",
      table.name);
}

}  // namespace hueline::drivers
