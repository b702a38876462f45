#include "fusion/camera_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hueline::fusion {
namespace {
constexpr double kPlaneLimit = 1.5533;  // rad, 89 degrees: the plane model's image point runs away towards 90
constexpr double kInvertibleShare = 0.999;  // of the invertible range: the slope vanishes at its end
constexpr int kNewtonSteps = 60;
constexpr double kNewtonStep = 1e-13;

bool all_finite(const std::array<double, 5>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}
}  // namespace

std::string CameraIntrinsics::validate() const {
  if (width < 8 || width > 65535) return fmt::format("width is {}; allowed: 8 to 65535 px", width);
  if (height < 8 || height > 65535) return fmt::format("height is {}; allowed: 8 to 65535 px", height);
  for (int i = 0; i < 2; ++i) {
    if (!(focal_px[i] > 1.0 && focal_px[i] < 1e6)) {
      return fmt::format("focal_px is {}; allowed: 1 to 1000000 px", focal_px[i]);
    }
    if (!(std::abs(principal_point_px[i]) < 1e6)) {
      return fmt::format("principal_point_px is {}; allowed: -1000000 to 1000000 px", principal_point_px[i]);
    }
  }
  if (!all_finite(distortion)) return "distortion has a value that is not a number";
  if (!(max_angle > 0.01 && max_angle <= 2.5)) {
    return fmt::format("max_angle is {}; allowed: 0.01 to 2.5 rad", max_angle);
  }
  return {};
}

CameraModel::CameraModel(const CameraIntrinsics& intrinsics) : intrinsics_(intrinsics) {
  if (intrinsics_.model == LensModel::Brown) {
    max_angle_ = std::min({intrinsics_.max_angle, kPlaneLimit, std::atan(radial_limit_brown())});
    return;
  }
  // The first angle at which the image radius stops growing.
  double end = std::min(intrinsics_.max_angle, std::numbers::pi);
  constexpr int kSteps = 20000;
  for (int i = 1; i <= kSteps; ++i) {
    const double angle = end * i / kSteps;
    if (distort_angle_slope(angle) <= 0) {
      end = end * (i - 1) / kSteps * kInvertibleShare;
      break;
    }
  }
  max_angle_ = end;
}

CameraModel::Distorted CameraModel::distort_brown(const Eigen::Vector2d& xy) const {
  const auto& [k1, k2, p1, p2, k3] = intrinsics_.distortion;
  const double x = xy.x(), y = xy.y(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3));  // d radial / d r2, times 2
  Distorted d;
  d.xy = {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
  d.jacobian << radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y,
      x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y, radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return d;
}

double CameraModel::radial_limit_brown() const {
  // The tangent of the angle up to which the map keeps its orientation in every direction around the axis, tangential terms included.
  constexpr int kSteps = 4000, kDirections = 64;
  const double end = std::tan(std::min(intrinsics_.max_angle, kPlaneLimit));
  const double end_angle = std::atan(end);
  for (int i = 1; i <= kSteps; ++i) {
    const double r = std::tan(end_angle * i / kSteps);
    for (int j = 0; j < kDirections; ++j) {
      const double a = 2.0 * std::numbers::pi * j / kDirections;
      const Eigen::Matrix2d jacobian = distort_brown({r * std::cos(a), r * std::sin(a)}).jacobian;
      if (jacobian.determinant() <= 0 || jacobian.trace() <= 0) {
        return std::tan(end_angle * (i - 1) / kSteps) * kInvertibleShare;
      }
    }
  }
  return end;
}

double CameraModel::distort_angle(double angle) const {
  const auto& k = intrinsics_.distortion;
  const double a2 = angle * angle;
  return angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
}

double CameraModel::distort_angle_slope(double angle) const {
  const auto& k = intrinsics_.distortion;
  const double a2 = angle * angle;
  return 1.0 + a2 * (3.0 * k[0] + a2 * (5.0 * k[1] + a2 * (7.0 * k[2] + a2 * 9.0 * k[3])));
}

std::optional<Eigen::Vector2d> CameraModel::project(const Point<Lens>& p_lens) const {
  const Eigen::Vector3d& p = p_lens.xyz;
  const double across = std::hypot(p.x(), p.y());
  const double angle = std::atan2(across, p.z());
  if (!(angle <= max_angle_) || !(across + std::abs(p.z()) > 0)) return std::nullopt;
  Eigen::Vector2d distorted;
  if (intrinsics_.model == LensModel::Brown) {
    distorted = distort_brown(p.head<2>() / p.z()).xy;
  } else {
    distorted = across > 0 ? Eigen::Vector2d(p.head<2>() * (distort_angle(angle) / across)) : Eigen::Vector2d::Zero();
  }
  return Eigen::Vector2d(distorted.cwiseProduct(intrinsics_.focal_px) + intrinsics_.principal_point_px);
}

std::optional<Vector<Lens>> CameraModel::unproject(const Eigen::Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const Eigen::Vector2d target = (pixel - intrinsics_.principal_point_px).cwiseQuotient(intrinsics_.focal_px);
  if (intrinsics_.model == LensModel::KannalaBrandt) {
    const double radius = target.norm();
    if (radius > distort_angle(max_angle_)) return std::nullopt;
    // Newton, kept inside a bracket: the radius grows with the angle over the whole range.
    double low = 0, high = max_angle_, angle = std::min(radius, max_angle_);
    for (int i = 0; i < kNewtonSteps; ++i) {
      const double error = distort_angle(angle) - radius;
      (error > 0 ? high : low) = angle;
      double next = angle - error / distort_angle_slope(angle);
      if (!(next >= low && next <= high)) next = 0.5 * (low + high);
      const double step = std::abs(next - angle);
      angle = next;
      if (step < kNewtonStep) break;
    }
    const double across = radius > 0 ? std::sin(angle) / radius : 0.0;
    return Vector<Lens>{{target.x() * across, target.y() * across, std::cos(angle)}};
  }

  // Start from the radial part alone (a bracketed search that cannot run away), then Newton in the plane with every term.
  const double radius = target.norm(), limit = std::tan(max_angle_);
  const auto& [k1, k2, p1, p2, k3] = intrinsics_.distortion;
  double low = 0, high = limit;
  for (int i = 0; i < 40; ++i) {
    const double r = 0.5 * (low + high), r2 = r * r;
    (r * (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) > radius ? high : low) = r;
  }
  Eigen::Vector2d xy = radius > 0 ? Eigen::Vector2d(target * (0.5 * (low + high) / radius)) : Eigen::Vector2d::Zero();
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Distorted d = distort_brown(xy);
    Eigen::Vector2d step = d.jacobian.inverse() * (target - d.xy);
    if (!step.allFinite()) return std::nullopt;
    const double longest = 0.25 * (1.0 + xy.norm());  // damped: near the limit a full step may leave the invertible range
    if (step.norm() > longest) step *= longest / step.norm();
    xy += step;
    if (step.norm() < kNewtonStep * (1.0 + xy.norm())) break;
  }
  // A target beyond the field of view ends outside it, or does not converge.
  if ((distort_brown(xy).xy - target).norm() > 1e-10 * (1.0 + radius) || xy.norm() > limit * (1.0 + 1e-12)) return std::nullopt;
  return Vector<Lens>{Eigen::Vector3d(xy.x(), xy.y(), 1.0).normalized()};
}

bool CameraModel::in_image(const Eigen::Vector2d& pixel, double border_px) const {
  return pixel.x() >= border_px && pixel.y() >= border_px && pixel.x() <= intrinsics_.width - 1.0 - border_px &&
         pixel.y() <= intrinsics_.height - 1.0 - border_px;
}

}  // namespace hueline::fusion
