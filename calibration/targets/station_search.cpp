#include "calibration/targets/station_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "calibration/decompositions.hpp"

namespace hueline::calibration {

std::vector<std::size_t> targets_of(const SurveyedStation& station, std::span<const SurveyedTarget> targets) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (targets[i].stations.empty() ||
        std::ranges::find(targets[i].stations, station.name) != targets[i].stations.end())
      out.push_back(i);
  return out;
}

double spread_of(std::span<const Eigen::Vector3d> places) {
  if (places.size() < 3) return 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : places) mean += p / static_cast<double>(places.size());
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const auto& p : places) moments += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d values = singular_values(moments).values;
  return values[0] > 0 ? std::sqrt(values[1] / values[0]) : 0;
}

Result<StationSearch> search_station(const ScanBlocks& scan, const SurveyedStation& station,
                                     std::span<const SurveyedTarget> targets, const TargetsConfig& config) {
  StationSearch out;
  out.targets = targets_of(station, targets);
  double largest = 0;
  for (const std::size_t i : out.targets) largest = std::max(largest, targets[i].radius_m);
  const double doubt = station.sigma_m ? std::max(3 * *station.sigma_m, 0.01) : config.station_doubt_m;
  std::vector<Ring> rings;
  for (const std::size_t i : out.targets) {
    out.distances.push_back((targets[i].position.xyz - station.position.xyz).norm());
    rings.push_back(ring_of(out.distances.back(), largest, doubt, config.detection));
  }
  auto points = read_rings(scan, rings, config.threads, config.most_ring_points);
  if (!points.ok()) return points.error();
  out.rings = std::move(points).value();

  out.detections.resize(out.targets.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < out.targets.size(); i = next++)
      out.detections[i] =
          detect_spheres(out.rings.points_scanner, rings[i], out.distances[i], targets[out.targets[i]].radius_m,
                         config.noise, config.method, config.detection);
  };
  {
    std::vector<std::jthread> helpers;
    for (unsigned i = 1; i < config.threads; ++i) helpers.emplace_back(work);
    work();
  }
  for (std::size_t i = 0; i < out.targets.size(); ++i) {
    const SurveyedTarget& target = targets[out.targets[i]];
    out.to_match.push_back({{target.position.xyz, target.sigma_m}, out.detections[i].candidates});
  }
  out.matching.gate_sigma = config.gate_sigma;
  out.matching.common_range_sigma_m = config.noise.common_range_sigma_m();
  out.matching.station_survey = station.position.xyz;
  out.matching.station_doubt_m = std::max(0.25, 4 * doubt);
  out.matching.most_tilt_rad = config.most_tilt_deg / 57.29577951308232;
  if (config.method == CentreMethod::KnownRadius) {
    out.result = match_by_distances(out.to_match, out.matching);
    return out;
  }
  // The published rule removes false candidates by their share of matching distances. At least three must remain, and
  // their rotation must be proper.
  const auto by_share = match_by_share(out.to_match, out.matching);
  std::vector<Eigen::Vector3d> scanner, survey;
  Match match;
  match.chosen = by_share;
  for (std::size_t i = 0; i < by_share.size(); ++i) {
    if (!by_share[i]) continue;
    scanner.push_back(out.to_match[i].candidates[*by_share[i]].centre_scanner);
    survey.push_back(out.to_match[i].surveyed.position_survey);
  }
  match.matched = scanner.size();
  if (const auto orientation = orient_closed_form(scanner, survey)) {
    match.orientation = *orientation;
    out.result.match = std::move(match);
  } else {
    out.result.failure.reason =
        fmt::format("only {} of the {} targets have trusted spheres at the surveyed mutual distances, and 3 are needed",
                    scanner.size(), out.targets.size());
  }
  return out;
}

Error refusal(const ScanBlocks& scan, std::span<const SurveyedStation> stations, std::size_t station,
              std::span<const SurveyedTarget> targets, const StationSearch& search, const TargetsConfig& config) {
  const std::string where = "station " + stations[station].name + ": ";
  const auto invalid = [&](const std::string& what) { return Error{ErrorCode::Invalid, where + what}; };
  if (search.rings.points_read == 0) return invalid("its scan holds no points");
  const double reach = search.rings.farthest_m;
  const auto beyond = static_cast<std::size_t>(
      std::ranges::count_if(search.distances, [&](double distance) { return distance > 1.02 * reach; }));
  if (reach > 20'000)
    return invalid(
        fmt::format("its scan reaches {:.0f} km from its origin: its points are in survey coordinates or in "
                    "millimetres; give the scan in the scanner's own frame, in metres",
                    reach / 1000));
  if (beyond > search.distances.size() / 2) {
    const double farthest = *std::ranges::max_element(search.distances);
    return invalid(fmt::format(
        "{} of its {} targets lie beyond the scan's reach of {:.1f} m (the farthest {:.1f} m): {}", beyond,
        search.distances.size(), reach, farthest,
        farthest > 200 * reach ? "are the surveyed coordinates in millimetres, or the station's in another system?"
                               : "wrong units (feet?), another station's scan, or targets of other stations: name "
                                 "theirs in the column stations"));
  }
  if (stations.size() > 1)
    for (std::size_t other = 0; other < stations.size(); ++other) {
      if (other == station || targets_of(stations[other], targets).size() < 3) continue;
      const auto there = search_station(scan, stations[other], targets, config);
      if (there.ok() && there->result.match &&
          there->result.match->matched > std::max<std::size_t>(3, search.result.failure.best))
        return invalid(fmt::format("its scan is that of station {} ({} targets agree there): the stations are mixed up",
                                   stations[other].name, there->result.match->matched));
    }
  std::string found;
  for (std::size_t i = 0; i < search.targets.size(); ++i)
    found += fmt::format("{}{}: {} at {:.1f} m", i ? ", " : "", targets[search.targets[i]].name,
                         search.detections[i].candidates.size(), search.distances[i]);
  return invalid(
      fmt::format("{}. Round objects found in the rings: {}. Check the targets' and the station's coordinates (axes, "
                  "units, target heights), the radius, and that the scan belongs to this station",
                  search.result.failure.reason, found));
}

}  // namespace hueline::calibration
