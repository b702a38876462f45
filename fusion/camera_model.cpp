#include "fusion/camera_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/calibration_record.hpp"
#include "core/portable_math.hpp"

namespace hueline::fusion {
namespace {
constexpr double kPlaneLimit = 1.5533;  // rad, 89 degrees; the plane model's image point goes to infinity towards 90
constexpr double kInvertibleShare = 0.999;  // share of the invertible range; the slope vanishes at its end
constexpr int kNewtonSteps = 60;
constexpr double kNewtonStep = 1e-13;

}  // namespace

void CameraIntrinsics::visit(Keys& keys) {
  keys.choice(required("model", "", "The lens model: the formulas of OpenCV's projectPoints, or of its fisheye."),
              model, {{"brown", LensModel::Brown}, {"kannala_brandt", LensModel::KannalaBrandt}});
  keys.whole(required("width", "px", "The width of the lens image."), width, {8, 65535});
  keys.whole(required("height", "px", "The height of the lens image."), height, {8, 65535});
  keys.numbers(required("focal_px", "px", "The focal lengths along columns and rows."), focal_px, {1, 1e6});
  keys.numbers(required("principal_point_px", "px", "The principal point; the centre of the first pixel is (0, 0)."),
               principal_point_px, {-1e6, 1e6});
  std::vector<double> given(distortion.begin(), distortion.end());
  if (keys.numbers(required("distortion", "",
                            "brown: at most 5 numbers, k1 k2 p1 p2 k3; kannala_brandt: at most 4 numbers, k1 k2 k3 k4. "
                            "Missing ones are 0."),
                   given, {-1000, 1000}, {0, 5})) {
    distortion.fill(0);
    std::copy(given.begin(), given.end(), distortion.begin());
  }
  keys.angle({"max_angle_deg", "deg",
              "The largest angle from the optical axis that is projected. It is lowered to the range in which the "
              "model can be inverted."},
             max_angle, {1, 143});
  std::optional<CalibrationRecord> record;
  keys.section({"calibration", "", "How `model` to `distortion` were found: a [record](#calibration-records).", "none"},
               record);
}

KeyError CameraIntrinsics::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (model == LensModel::KannalaBrandt && distortion[4] != 0)
    return {"distortion", "has 5 numbers; allowed with kannala_brandt: at most 4, k1 k2 k3 k4"};
  return {};
}

CameraModel::CameraModel(const CameraIntrinsics& intrinsics) : intrinsics_(intrinsics) {
  if (intrinsics_.model == LensModel::Brown) {
    max_angle_ = std::min({intrinsics_.max_angle, kPlaneLimit, portable::atan(radial_limit_brown())});
    return;
  }
  // Finds the first angle at which the image radius stops growing.
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
  // Returns the tangent of the angle up to which the map keeps its orientation in every direction around the axis,
  // including the tangential terms.
  constexpr int kSteps = 4000, kDirections = 64;
  const double end = portable::tan(std::min(intrinsics_.max_angle, kPlaneLimit));
  const double end_angle = portable::atan(end);
  for (int i = 1; i <= kSteps; ++i) {
    const double r = portable::tan(end_angle * i / kSteps);
    for (int j = 0; j < kDirections; ++j) {
      const double a = 2.0 * std::numbers::pi * j / kDirections;
      const Eigen::Matrix2d jacobian = distort_brown({r * portable::cos(a), r * portable::sin(a)}).jacobian;
      if (jacobian.determinant() <= 0 || jacobian.trace() <= 0) {
        return portable::tan(end_angle * (i - 1) / kSteps) * kInvertibleShare;
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
  const double across = portable::hypot(p.x(), p.y());
  const double angle = portable::atan2(across, p.z());
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
    // Newton's method inside a bracket. The radius grows with the angle over the whole range.
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
    const double across = radius > 0 ? portable::sin(angle) / radius : 0.0;
    return Vector<Lens>{{target.x() * across, target.y() * across, portable::cos(angle)}};
  }

  // First solves the radial part alone by bisection, which always converges; then uses Newton's method in the plane
  // with all terms.
  const double radius = target.norm(), limit = portable::tan(max_angle_);
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
    const double longest =
        0.25 * (1.0 + xy.norm());  // damped, because near the limit a full step may leave the invertible range
    if (step.norm() > longest) step *= longest / step.norm();
    xy += step;
    if (step.norm() < kNewtonStep * (1.0 + xy.norm())) break;
  }
  // For a target beyond the field of view, the result lies outside it, or the iteration does not converge.
  if ((distort_brown(xy).xy - target).norm() > 1e-10 * (1.0 + radius) || xy.norm() > limit * (1.0 + 1e-12))
    return std::nullopt;
  return Vector<Lens>{Eigen::Vector3d(xy.x(), xy.y(), 1.0).normalized()};
}

bool CameraModel::in_image(const Eigen::Vector2d& pixel, double border_px) const {
  return pixel.x() >= border_px && pixel.y() >= border_px && pixel.x() <= intrinsics_.width - 1.0 - border_px &&
         pixel.y() <= intrinsics_.height - 1.0 - border_px;
}

}  // namespace hueline::fusion
