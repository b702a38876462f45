#include "apps/colour/other_lens.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hueline::apps {
namespace {

constexpr double kWidest = 1.9;  // angle from the axis, rad, as CameraIntrinsics::max_angle
constexpr int kAngles = 400;     // in a fit, and in its test
constexpr int kDirections = 48;

/// Returns the largest angle with a pixel in the image, rad.
double widest_angle(const OtherLens& lens) {
  const Eigen::Vector2d size(lens.width, lens.height), c = lens.principal_point_px;
  const double farthest_px = c.cwiseMax(size - c).norm(), focal_px = lens.focal_px.minCoeff();
  constexpr double kStep = 0.001;
  double angle = 0, radius = 0;
  while (angle + kStep < kWidest) {
    const double next = lens.radius(angle + kStep).distorted;
    if (!(next > radius)) return angle;
    angle += kStep;
    radius = next;
    if (radius * focal_px > farthest_px) return angle;
  }
  return angle;
}

/// Returns a lens of one model whose radii are nearest by least squares: a scale and the coefficients of the odd powers
/// of the angle, or of its tangent.
fusion::CameraIntrinsics fitted(const OtherLens& lens, fusion::LensModel model, double widest) {
  const bool is_brown = model == fusion::LensModel::Brown;
  const Eigen::Index terms = is_brown ? 4 : 5;
  const double end = is_brown ? std::tan(widest) : widest;
  Eigen::MatrixXd powers(kAngles, terms);
  Eigen::VectorXd radii(kAngles);
  for (Eigen::Index i = 0; i < kAngles; ++i) {
    const double angle = widest * static_cast<double>(i + 1) / kAngles, x = (is_brown ? std::tan(angle) : angle) / end;
    radii[i] = lens.radius(angle).distorted;
    double power = x;
    for (Eigen::Index k = 0; k < terms; ++k, power *= x * x) powers(i, k) = power;
  }
  const Eigen::VectorXd found = powers.colPivHouseholderQr().solve(radii);
  const double scale = found[0] / end;
  const auto k = [&](Eigen::Index power) {
    return found[power] / std::pow(end, static_cast<double>(2 * power + 1)) / scale;
  };
  fusion::CameraIntrinsics out;
  out.model = model;
  out.width = lens.width;
  out.height = lens.height;
  out.focal_px = scale * lens.focal_px;
  out.principal_point_px = lens.principal_point_px;
  if (is_brown)
    out.distortion = {k(1), k(2), lens.p1 / scale, lens.p2 / scale, k(3)};
  else
    out.distortion = {k(1), k(2), k(3), k(4), 0};
  out.max_angle = widest;
  return out;
}

/// Returns the largest distance between the pixels of the two lenses, of all directions that `lens` has in its image.
double worst_distance_px(const OtherLens& lens, const fusion::CameraIntrinsics& other, double widest) {
  const fusion::CameraModel model(other);
  double worst = 0;
  for (int i = 1; i < kAngles; ++i) {
    const double angle = widest * i / kAngles;
    const LensRadius radius = lens.radius(angle);
    const double r = radius.distorted, m2 = radius.plain * radius.plain;
    for (int j = 0; j < kDirections; ++j) {
      const double turn = 2 * std::numbers::pi * j / kDirections, c = std::cos(turn), s = std::sin(turn);
      const Eigen::Vector2d plane(r * c + m2 * (2 * lens.p1 * c * s + lens.p2 * (1 + 2 * c * c)),
                                  r * s + m2 * (lens.p1 * (1 + 2 * s * s) + 2 * lens.p2 * c * s));
      const Eigen::Vector2d pixel = plane.cwiseProduct(lens.focal_px) + lens.principal_point_px;
      if (!model.in_image(pixel)) continue;
      const auto found = model.project({{std::sin(angle) * c, std::sin(angle) * s, std::cos(angle)}});
      if (!found) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, (*found - pixel).norm());
    }
  }
  return worst;
}

}  // namespace

std::optional<NearestLens> nearest_lens(const OtherLens& lens) {
  constexpr double kWidestPlane = 1.4;  // beyond this the tangent grows too fast for a polynomial
  const double widest = widest_angle(lens);
  if (!(widest > 0.01) || lens.width == 0 || lens.height == 0) return std::nullopt;
  std::optional<NearestLens> best;
  for (const auto model : {fusion::LensModel::Brown, fusion::LensModel::KannalaBrandt}) {
    if (model == fusion::LensModel::Brown && widest > kWidestPlane) continue;
    const fusion::CameraIntrinsics one = fitted(lens, model, widest);
    if (!one.validate().empty()) continue;
    const double worst = worst_distance_px(lens, one, widest);
    if (!best || worst < best->worst_px) best = NearestLens{one, worst};
  }
  return best;
}

}  // namespace hueline::apps
