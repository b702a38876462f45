#include "calibration/targets/targets_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/angle.hpp"
#include "core/calibration_record.hpp"

namespace hueline::calibration {
namespace {

using Json = nlohmann::ordered_json;

Json list(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json target_json(const TargetOutcome& outcome, const SurveyedTarget& target) {
  Json out{{"name", target.name},
           {"state", name(outcome.state)},
           {"radius_m", target.radius_m},
           {"surveyed_m", list(target.position.xyz)},
           {"survey_sigma_m", target.sigma_m},
           {"ring_points", outcome.counts.points},
           {"cells", outcome.counts.cells},
           {"right_size", outcome.counts.right_size},
           {"round", outcome.counts.round},
           {"candidates", outcome.counts.candidates}};
  if (!outcome.reason.empty()) out["reason"] = outcome.reason;
  if (!outcome.is_found()) return out;
  out["points"] = outcome.points;
  out["roundness"] = outcome.roundness;
  out["points_chi_squared"] = outcome.chi_squared;
  out["centre_scanner_m"] = list(outcome.centre_scanner);
  Json covariance = Json::array();
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column) covariance.push_back(outcome.covariance_scanner(row, column));
  out["centre_covariance_m2"] = covariance;
  out["residual_m"] = list(outcome.residual_survey);
  out["residual_sigma_m"] = list(outcome.residual_sigma);
  return out;
}

}  // namespace

std::string targets_json(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsConfig& config,
                         const TargetsRunNotes& notes) {
  Json root{{"date", notes.date},
            {"program", notes.program},
            {"method", config.method == CentreMethod::KnownRadius ? "known radius" : "as published"},
            {"range_precision_m", config.noise.range_precision_m},
            {"range_accuracy_m", config.noise.range_accuracy_m},
            {"angle_rad", config.noise.angle_rad},
            {"stations", Json::array()},
            {"refused", notes.refused}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    const StationResult& result = results[i];
    const Orientation& o = result.adjusted.orientation;
    const Eigen::Quaterniond& q = o.T_survey_scanner.rotation;
    Json station{{"name", stations[result.station].name},
                 {"scan", i < notes.scans.size() ? notes.scans[i] : ""},
                 {"points_read", result.points_read},
                 {"ring_points", result.ring_points},
                 {"position_m", list(o.T_survey_scanner.translation)},
                 {"quaternion_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
    if (const auto abc = rodrigues_parameters(q)) station["rodrigues_abc"] = list(*abc);
    station["scale"] = o.scale;
    Json covariance = Json::array();
    for (int row = 0; row < 7; ++row)
      for (int column = row; column < 7; ++column) covariance.push_back(result.adjusted.covariance(row, column));
    station["covariance_rotation_rad_position_m_scale"] = covariance;
    station["chi_squared"] = result.chi_squared;
    station["freedom"] = result.freedom;
    station["spread"] = result.spread;
    station["other_spheres"] = result.others_scanner.size();
    station["targets"] = Json::array();
    for (const TargetOutcome& outcome : result.targets)
      station["targets"].push_back(target_json(outcome, targets[outcome.target]));
    root["stations"].push_back(std::move(station));
  }
  return root.dump(1) + "\n";
}

std::string targets_yaml(std::span<const StationResult> results, std::span<const SurveyedStation> stations,
                         std::span<const SurveyedTarget> targets, const TargetsRunNotes& notes) {
  std::string out =
      "# p_survey = scale * R * p_scanner + position_m; survey: x east, y north, z up. Made by hueline calibrate "
      "targets.\nstations:\n";
  for (std::size_t i = 0; i < results.size(); ++i) {
    const StationResult& result = results[i];
    const Orientation& o = result.adjusted.orientation;
    const Eigen::Vector3d& t = o.T_survey_scanner.translation;
    const Eigen::Quaterniond& q = o.T_survey_scanner.rotation;
    out += fmt::format(
        "  {}:\n    T_survey_scanner:\n      position_m: [{:.5f}, {:.5f}, {:.5f}]\n      quaternion_wxyz: [{:.12f}, "
        "{:.12f}, {:.12f}, {:.12f}]\n",
        stations[result.station].name, t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z());
    if (const auto abc = rodrigues_parameters(q))
      out += fmt::format("      rodrigues_abc: [{:.12f}, {:.12f}, {:.12f}]\n", abc->x(), abc->y(), abc->z());
    out += fmt::format("      scale: {:.9f}\n", o.scale);
    CalibrationRecord record;
    record.method = std::string("targets");
    record.date = notes.date;
    if (i < notes.scans.size()) record.data.push_back(notes.scans[i]);
    record.residual_unit = std::string("m");
    double squares = 0;
    std::size_t used = 0;
    for (const TargetOutcome& outcome : result.targets) {
      if (outcome.state != TargetState::Used) continue;
      squares += outcome.residual_survey.squaredNorm();
      ++used;
      record.data.push_back(fmt::format("target {}: {} points", targets[outcome.target].name, outcome.points));
    }
    record.residual_rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(used, 1)));
    const char* names[] = {"rotation_east_deg", "rotation_north_deg", "rotation_up_deg", "east_m", "north_m", "up_m"};
    for (int k = 0; k < 6; ++k) {
      const double unit = k < 3 ? kDegPerRad : 1;
      record.parameters.emplace_back(names[k]);
      record.sigma.push_back(unit * std::sqrt(result.adjusted.covariance(k, k)));
      for (int m = k; m < 6; ++m)
        record.covariance.push_back(unit * (m < 3 ? kDegPerRad : 1) * result.adjusted.covariance(k, m));
    }
    out += record.yaml(6);
  }
  return out;
}

}  // namespace hueline::calibration
