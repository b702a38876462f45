#include "drivers/beam_angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>

#include "core/angle.hpp"
#include "core/input_file.hpp"
#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint64_t kMostBytes = 1'000'000;
constexpr std::size_t kMostChannels = 1024;
/// The beams of one scanner point elsewhere than its model's nominal directions say, by some tenths of a degree: the
/// calibrations of scanners that were compared are up to 0.17 degrees off. What is farther off is not of this model.
constexpr double kMostOffNominal_deg = 1.5;

bool has_as_many(const BeamAngles& a, const BeamAngles& b) {
  return a.elevations_deg.size() == b.elevations_deg.size() && a.azimuths_deg.size() == b.azimuths_deg.size();
}

/// Compares the directions of one scanner with the nominal ones of a model that has as many beams. Returns, for people,
/// the beam that is farthest off and where it and the model's point, or nothing if all are near enough.
std::string off_nominal(const BeamAngles& given, const BeamAngles& nominal) {
  std::size_t farthest = 0;
  double most_deg = 0;
  for (std::size_t i = 0; i < nominal.elevations_deg.size(); ++i) {
    // Near the zenith an azimuth turns the beam by less than itself.
    const double aside_deg = std::remainder(given.azimuths_deg[i] - nominal.azimuths_deg[i], 360.0) *
                             portable::cos(nominal.elevations_deg[i] * kRadPerDeg);
    const double off_deg = std::max(std::abs(given.elevations_deg[i] - nominal.elevations_deg[i]), std::abs(aside_deg));
    if (off_deg <= most_deg) continue;
    farthest = i;
    most_deg = off_deg;
  }
  if (most_deg <= kMostOffNominal_deg) return {};
  return fmt::format(
      "channel {} points to elevation {:.3f} and azimuth {:.3f} deg, the model's to {:.3f} and {:.3f} deg",
      farthest + 1, given.elevations_deg[farthest], given.azimuths_deg[farthest], nominal.elevations_deg[farthest],
      nominal.azimuths_deg[farthest]);
}

}  // namespace

std::string why_not_of(const ModelAngles& model, const std::vector<ModelAngles>& all, const BeamAngles& given,
                       const std::string& other_count) {
  const std::string wrong = has_as_many(model.nominal, given) ? off_nominal(given, model.nominal) : other_count;
  if (wrong.empty()) return {};
  std::string others;
  for (const ModelAngles& other : all)
    if (has_as_many(other.nominal, given) && off_nominal(given, other.nominal).empty())
      others += fmt::format("{}{}", others.empty() ? "" : " or ", other.model);
  return fmt::format(
      "these are not the directions of a {}: {}; a scanner's own are within {} deg of its model's{}; give the file of "
      "this very scanner",
      model.model, wrong, kMostOffNominal_deg, others.empty() ? "" : ", and these fit the model " + others);
}

Result<BeamAngles> read_beam_angles(const std::string& path) {
  const auto text = read_input(path, kMostBytes, "a calibration file");
  if (!text.ok()) return text.error();
  BeamAngles out;
  out.file = path;
  std::istringstream lines(*text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::ranges::replace(line, ',', ' ');
    std::istringstream words(line);
    double channel = 0, elevation = 0, azimuth = 0;
    if (!(words >> channel)) continue;  // names of the columns, or an empty line
    if (!(words >> elevation >> azimuth) || !(std::abs(elevation) <= 90) || !(std::abs(azimuth) <= 360))
      return Error{ErrorCode::Unsupported, fmt::format("{}:{}: no line \"channel,elevation,azimuth\"", path, number)};
    if (channel != static_cast<double>(out.elevations_deg.size() + 1) || out.elevations_deg.size() >= kMostChannels)
      return Error{ErrorCode::Malformed, fmt::format("{}:{}: channel {} where {} is expected", path, number, channel,
                                                     out.elevations_deg.size() + 1)};
    out.elevations_deg.push_back(elevation);
    out.azimuths_deg.push_back(azimuth);
  }
  if (out.elevations_deg.empty())
    return Error{ErrorCode::Unsupported, path + ": no line \"channel,elevation,azimuth\""};
  return out;
}

}  // namespace hueline::drivers
