#include "calibration/lens/lens_report.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace hueline::calibration {
namespace {

using Json = nlohmann::ordered_json;

std::string list(const double* values, int count) {
  std::string out = "[";
  for (int i = 0; i < count; ++i) out += fmt::format("{}{:.10g}", i ? ", " : "", values[i]);
  return out + "]";
}

}  // namespace

double covered_angle(const LensCalibration& calibration) {
  double widest = 0;
  for (const BoardView& view : calibration.views)
    for (const SeenCorner& corner : view.corners)
      if (const auto ray = calibration.adjusted.lens.direction(corner.pixel))
        widest = std::max(widest, std::acos(std::clamp(ray->z(), -1.0, 1.0)));
  return widest;
}

CalibrationRecord lens_record(const LensCalibration& calibration, const LensReportContext& context) {
  CalibrationRecord record;
  record.method = "lens";
  record.date = context.date;
  record.data = {context.data};
  for (const auto& view : calibration.rejected_views) record.data.push_back("left out: " + view.view);
  record.residual_rms = calibration.adjusted.rms_px;
  record.residual_unit = "px";
  const auto names = parameter_names(calibration.adjusted.lens.model);
  const int n = parameter_count(calibration.adjusted.lens.model);
  for (int i = 0; i < n; ++i) {
    record.parameters.push_back(names[static_cast<std::size_t>(i)]);
    record.sigma.push_back(std::sqrt(std::max(0.0, calibration.adjusted.covariance(i, i))));
    for (int j = i; j < n; ++j) record.covariance.push_back(calibration.adjusted.covariance(i, j));
  }
  return record;
}

std::string lens_fragment(const LensCalibration& calibration, const LensReportContext& context, int indent) {
  const LensValues& lens = calibration.adjusted.lens;
  const std::string in(static_cast<std::size_t>(indent), ' ');
  constexpr double kMargin = 1.1, kWidest_deg = 143;
  const double angle_deg = std::clamp(kMargin * covered_angle(calibration) * 180 / std::numbers::pi, 1.0, kWidest_deg);
  return fmt::format(
             "{0}model: {1}\n{0}width: {2}\n{0}height: {3}\n{0}focal_px: {4}\n{0}principal_point_px: "
             "{5}\n{0}distortion: {6}\n"
             "{0}max_angle_deg: {7:.1f}\n",
             in, name(lens.model), lens.width, lens.height, list(lens.focal_px.data(), 2),
             list(lens.principal_point_px.data(), 2),
             list(lens.distortion.data(), lens.model == LensModel::Brown ? 5 : 4), angle_deg) +
         lens_record(calibration, context).yaml(indent);
}

std::string lens_json(const LensCalibration& calibration, const LensReportContext& context) {
  const AdjustedLens& adjusted = calibration.adjusted;
  Json out;
  out["tool"] = "calibrate lens";
  out["date"] = context.date;
  out["data"] = context.data;
  out["model"] = name(adjusted.lens.model);
  out["width"] = adjusted.lens.width;
  out["height"] = adjusted.lens.height;
  const auto names = parameter_names(adjusted.lens.model);
  const auto values = adjusted.lens.parameters();
  const int n = parameter_count(adjusted.lens.model);
  for (int i = 0; i < n; ++i)
    out["values"][names[static_cast<std::size_t>(i)]] = {
        {"value", values[static_cast<std::size_t>(i)]}, {"sigma", std::sqrt(std::max(0.0, adjusted.covariance(i, i)))}};
  for (int i = 0; i < n; ++i) {
    Json row = Json::array();
    for (int j = 0; j < n; ++j) row.push_back(adjusted.covariance(i, j));
    out["covariance"].push_back(row);
  }
  out["rms_px"] = adjusted.rms_px;
  out["corner_sigma_px"] = adjusted.sigma_px;
  out["disagreement"] = adjusted.disagreement;
  out["corners"] = adjusted.observations / 2;
  out["redundancy"] = adjusted.observations - adjusted.unknowns;
  if (calibration.is_bent()) {
    out["board"]["bend_height_m"] = calibration.board.bend_height();
    out["board"]["bend_m"] = calibration.board.bend_m;
  }
  out["covered_angle_deg"] = covered_angle(calibration) * 180 / std::numbers::pi;
  if (calibration.two_lenses) out["two_lenses"] = calibration.two_lenses->words();
  for (const ModelTrial& trial : calibration.trials) {
    Json one{{"model", name(trial.model)}};
    if (trial.failure.empty()) {
      one["rms_px"] = trial.rms_px;
      if (trial.predicted_rms_px) one["predicted_rms_px"] = *trial.predicted_rms_px;
      for (const auto& view : trial.unpredicted)
        one["unpredicted"].push_back({{"image", view.view}, {"why", view.why}});
    } else {
      one["failure"] = trial.failure;
    }
    out["trials"].push_back(one);
  }
  for (std::size_t v = 0; v < calibration.views.size(); ++v) {
    const BoardPose& pose = adjusted.poses[v];
    Json view{{"image", calibration.views[v].name},
              {"rotation_vector", {pose.rotation.x(), pose.rotation.y(), pose.rotation.z()}},
              {"translation_m", {pose.translation_m.x(), pose.translation_m.y(), pose.translation_m.z()}}};
    double sum = 0;
    for (std::size_t c = 0; c < calibration.views[v].corners.size(); ++c) {
      const SeenCorner& corner = calibration.views[v].corners[c];
      const Eigen::Vector2d& r = adjusted.residuals[v][c];
      sum += r.squaredNorm();
      view["corners"].push_back({corner.index, corner.pixel.x(), corner.pixel.y(), r.x(), r.y()});
    }
    view["rms_px"] = std::sqrt(sum / static_cast<double>(calibration.views[v].corners.size()));
    out["views"].push_back(view);
  }
  out["left_out"]["views"] = Json::array();
  out["left_out"]["corners"] = Json::array();
  out["left_out"]["unseen"] = context.unseen;
  for (const auto& view : calibration.rejected_views)
    out["left_out"]["views"].push_back({{"image", view.view}, {"why", view.why}});
  for (const auto& corner : calibration.rejected_corners)
    out["left_out"]["corners"].push_back(
        {{"image", corner.view}, {"corner", corner.index}, {"error_px", corner.error_px}});
  if (!context.reference.empty()) out["reference"] = context.reference;
  return out.dump(1) + "\n";
}

}  // namespace hueline::calibration
