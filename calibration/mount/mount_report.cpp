#include "calibration/mount/mount_report.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

namespace hueline::calibration {

std::string mounting_yaml(const std::string& key, const Eigen::Quaterniond& rotation, const Eigen::Vector3d& p,
                          const CalibrationRecord& record, int indent) {
  const std::string in(static_cast<std::size_t>(indent), ' ');
  const Eigen::Quaterniond q = rotation.w() < 0 ? Eigen::Quaterniond(-rotation.coeffs()) : rotation;
  return fmt::format(
             "{0}{1}:\n{0}  position_m: [{2:.6f}, {3:.6f}, {4:.6f}]\n{0}  quaternion_wxyz: [{5:.10f}, {6:.10f}, "
             "{7:.10f}, {8:.10f}]\n",
             in, key, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()) +
         record.yaml(indent + 2);
}

CalibrationRecord mount_record(const Eigen::Matrix<double, 6, 6>& covariance, const Eigen::Matrix3d& R_frame_scanner,
                               const std::string& date, const std::vector<std::string>& data, double residual_rms_px) {
  Eigen::Matrix<double, 6, 6> to = Eigen::Matrix<double, 6, 6>::Zero();
  to.topLeftCorner<3, 3>().diagonal().setConstant(180 / std::numbers::pi);
  to.bottomRightCorner<3, 3>() = R_frame_scanner;
  const Eigen::Matrix<double, 6, 6> turned = to * covariance * to.transpose();
  CalibrationRecord record;
  record.method = "mount";
  record.date = date;
  record.data = data;
  record.residual_rms = residual_rms_px;
  record.residual_unit = "px";
  record.parameters = {"turn_lens_x_deg", "turn_lens_y_deg", "turn_lens_z_deg",
                       "position_x_m",    "position_y_m",    "position_z_m"};
  for (int i = 0; i < 6; ++i) {
    record.sigma.push_back(std::sqrt(std::max(0.0, turned(i, i))));
    for (int j = i; j < 6; ++j) record.covariance.push_back(turned(i, j));
  }
  return record;
}

std::string resection_json(const std::string& lens, const std::vector<Correspondence>& points,
                           const Resection& resection) {
  nlohmann::ordered_json out;
  const auto& T = resection.T_scanner_lens;
  out["lens"] = lens;
  out["T_scanner_lens"] = {{"position_m", {T.translation.x(), T.translation.y(), T.translation.z()}},
                           {"quaternion_wxyz", {T.rotation.w(), T.rotation.x(), T.rotation.y(), T.rotation.z()}}};
  const CalibrationRecord record =
      mount_record(resection.covariance, Eigen::Matrix3d::Identity(), "", {}, resection.rms_px);
  for (std::size_t i = 0; i < record.parameters.size(); ++i) out["sigma"][record.parameters[i]] = record.sigma[i];
  out["rms_px"] = resection.rms_px;
  out["unit_sigma"] = resection.unit_sigma;
  out["points"] = points.size();
  out["used"] = resection.used;
  for (std::size_t i = 0; i < points.size(); ++i)
    out["residuals_px"].push_back({{"name", points[i].name},
                                   {"u", resection.residuals[i].x()},
                                   {"v", resection.residuals[i].y()},
                                   {"used", bool(resection.is_used[i])}});
  return out.dump(1) + "\n";
}

}  // namespace hueline::calibration
