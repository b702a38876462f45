#include "calibration/lens/lens_values.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace hueline::calibration {
namespace {
constexpr int kSteps = 100;
constexpr double kDone = 1e-13;
}  // namespace

const char* name(LensModel model) { return model == LensModel::Brown ? "brown" : "kannala_brandt"; }

std::array<std::string, kLensParameters> parameter_names(LensModel model) {
  if (model == LensModel::Brown)
    return {"focal_x_px", "focal_y_px", "principal_x_px", "principal_y_px", "k1", "k2", "p1", "p2", "k3"};
  return {"focal_x_px", "focal_y_px", "principal_x_px", "principal_y_px", "k1", "k2", "k3", "k4", ""};
}

std::array<double, kLensParameters> LensValues::parameters() const {
  return {focal_px.x(),  focal_px.y(),  principal_point_px.x(), principal_point_px.y(), distortion[0],
          distortion[1], distortion[2], distortion[3],          distortion[4]};
}

void LensValues::set_parameters(const std::array<double, kLensParameters>& values) {
  focal_px = {values[0], values[1]};
  principal_point_px = {values[2], values[3]};
  std::copy(values.begin() + 4, values.end(), distortion.begin());
}

std::optional<Eigen::Vector2d> LensValues::project(const Eigen::Vector3d& p_lens) const {
  const auto values = parameters();
  Eigen::Vector2d pixel;
  if (!project_with(model, values.data(), p_lens.data(), pixel.data()) || !pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector3d> LensValues::direction(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target = (pixel - principal_point_px).cwiseQuotient(focal_px);
  if (model == LensModel::KannalaBrandt) {
    const double radius = target.norm();
    if (!(radius > 0)) return Eigen::Vector3d(0, 0, 1);
    double angle = std::min(radius, 1.5);
    for (int i = 0; i < kSteps; ++i) {
      const double a2 = angle * angle;
      const auto& k = distortion;
      const double value = angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
      const double slope = 1 + a2 * (3 * k[0] + a2 * (5 * k[1] + a2 * (7 * k[2] + a2 * 9 * k[3])));
      if (!(slope > 1e-6)) return std::nullopt;
      const double step = (value - radius) / slope;
      angle -= std::clamp(step, -0.3, 0.3);
      if (std::abs(step) < kDone) break;
    }
    if (!(angle > 0 && angle < 3.1)) return std::nullopt;
    const double across = std::sin(angle) / radius;
    return Eigen::Vector3d(target.x() * across, target.y() * across, std::cos(angle));
  }
  // Newton's method in the image plane. The derivative is a difference quotient of the same formula, which is exact
  // enough to converge.
  LensValues unit = *this;
  unit.focal_px = {1, 1};
  unit.principal_point_px = {0, 0};
  const auto values = unit.parameters();
  const auto at = [&](const Eigen::Vector2d& xy) {
    const Eigen::Vector3d p(xy.x(), xy.y(), 1);
    Eigen::Vector2d out;
    project_with(model, values.data(), p.data(), out.data());
    return out;
  };
  Eigen::Vector2d xy = target;
  for (int i = 0; i < kSteps; ++i) {
    constexpr double h = 1e-6;
    const Eigen::Vector2d error = at(xy) - target;
    Eigen::Matrix2d jacobian;
    jacobian.col(0) = (at(xy + Eigen::Vector2d(h, 0)) - at(xy - Eigen::Vector2d(h, 0))) / (2 * h);
    jacobian.col(1) = (at(xy + Eigen::Vector2d(0, h)) - at(xy - Eigen::Vector2d(0, h))) / (2 * h);
    Eigen::Vector2d step = jacobian.inverse() * error;
    if (!step.allFinite()) return std::nullopt;
    if (step.norm() > 0.3 * (1 + xy.norm())) step *= 0.3 * (1 + xy.norm()) / step.norm();
    xy -= step;
    if (step.norm() < kDone) break;
  }
  if (!((at(xy) - target).norm() < 1e-9)) return std::nullopt;
  return Eigen::Vector3d(xy.x(), xy.y(), 1).normalized();
}

}  // namespace hueline::calibration
