#include "score/time_figures.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace hueline::score {
namespace {

/// Returns the smallest value that the share `share` of the values do not exceed.
double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

}  // namespace

void add_time_figures(const std::vector<ExposureError>& errors, std::size_t exposures_made, ScenarioScore& score) {
  Figures& f = score.figures;
  f["exposures_stamped_share"] =
      exposures_made ? Figure{static_cast<double>(errors.size()) / static_cast<double>(exposures_made), {}}
                     : Figure{{}, "the camera made no exposure"};
  const std::string none = exposures_made ? "no exposure was stamped" : "the camera made no exposure";
  for (const char* name : {"exposure_time_rms_us", "exposure_time_p99_us", "exposure_time_coverage_95",
                           "exposure_time_coverage_1s", "exposure_time_coverage_2s", "exposure_time_coverage_3s"})
    f[name] = {{}, none};
  for (const char* name : {"pose_position_rms_m", "pose_attitude_rms_deg"})
    f[name] = {{}, errors.empty() ? none : "no stamped exposure has a pose"};
  if (errors.empty()) return;

  std::vector<double> absolute;
  double square = 0, position2 = 0, attitude2 = 0;
  std::size_t poses = 0;
  for (const ExposureError& e : errors) {
    absolute.push_back(std::abs(e.error_us));
    square += e.error_us * e.error_us;
    if (!e.has_pose) continue;
    ++poses;
    position2 += dot(e.position_error_m, e.position_error_m);
    attitude2 += e.attitude_error_deg * e.attitude_error_deg;
  }
  const auto n = static_cast<double>(errors.size());
  const auto inside = [&](double sigmas) {
    // The small tolerance counts an error of 0 with a sigma of 0 as inside.
    const auto count = std::count_if(errors.begin(), errors.end(), [&](const ExposureError& e) {
      return std::abs(e.error_us) <= sigmas * e.sigma_us + 1e-9;
    });
    return Figure{static_cast<double>(count) / n, {}};
  };
  f["exposure_time_rms_us"] = {std::sqrt(square / n), {}};
  f["exposure_time_p99_us"] = {quantile(absolute, 0.99), {}};
  f["exposure_time_coverage_95"] = inside(1.96);
  f["exposure_time_coverage_1s"] = inside(1);
  f["exposure_time_coverage_2s"] = inside(2);
  f["exposure_time_coverage_3s"] = inside(3);
  if (poses) {
    f["pose_position_rms_m"] = {std::sqrt(position2 / static_cast<double>(poses)), {}};
    f["pose_attitude_rms_deg"] = {std::sqrt(attitude2 / static_cast<double>(poses)), {}};
  }

  Chart time{
      "Exposure time error, bars: 1.96 stated sigma", "s of the drive", "us", Chart::Kind::Points, false, {}, {}};
  Chart pose{"Place of the head at the exposures", "s of the drive", "mm", Chart::Kind::Lines, false, {}, {}};
  Chart::Curve stamped{"stamped - true", {}, {}};
  std::array<Chart::Curve, 3> axes{{{"east", {}, {}}, {"north", {}, {}}, {"up", {}, {}}}};
  for (const ExposureError& e : errors) {
    stamped.points.emplace_back(e.drive_s, e.error_us);
    stamped.plus_minus.push_back(1.96 * e.sigma_us);
    if (!e.has_pose) continue;
    axes[0].points.emplace_back(e.drive_s, 1e3 * e.position_error_m.x);
    axes[1].points.emplace_back(e.drive_s, 1e3 * e.position_error_m.y);
    axes[2].points.emplace_back(e.drive_s, 1e3 * e.position_error_m.z);
  }
  time.curves.push_back(std::move(stamped));
  pose.curves.assign(axes.begin(), axes.end());
  score.charts.push_back(std::move(time));
  score.charts.push_back(std::move(pose));
}

}  // namespace hueline::score
