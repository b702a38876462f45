#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/mount/resection.hpp"

namespace hueline::calibration {
namespace {

/// Returns the real roots of a[4] v^4 + ... + a[0], from the eigenvalues of the companion matrix, each improved by
/// Newton's method.
std::vector<double> real_roots(const std::array<double, 5>& a) {
  if (!(std::abs(a[4]) > 1e-14 * (std::abs(a[0]) + std::abs(a[1]) + std::abs(a[2]) + std::abs(a[3])))) return {};
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.bottomLeftCorner<3, 3>().setIdentity();
  for (int i = 0; i < 4; ++i) companion(i, 3) = -a[static_cast<std::size_t>(i)] / a[4];
  const Eigen::EigenSolver<Eigen::Matrix4d> solver(companion, false);
  std::vector<double> out;
  for (int i = 0; i < 4; ++i) {
    const auto root = solver.eigenvalues()[i];
    // A double root appears as a pair slightly off the real axis.
    if (std::abs(root.imag()) > 1e-4 * (1 + std::abs(root.real()))) continue;
    double v = root.real();
    for (int step = 0; step < 3; ++step) {
      const double value = (((a[4] * v + a[3]) * v + a[2]) * v + a[1]) * v + a[0];
      const double slope = ((4 * a[4] * v + 3 * a[3]) * v + 2 * a[2]) * v + a[1];
      if (!(std::abs(slope) > 1e-12)) break;
      v -= value / slope;
    }
    out.push_back(v);
  }
  return out;
}

/// Returns three orthonormal directions, as columns, that a triangle fixes: along its first side, across that side in
/// its plane, and normal to it.
Eigen::Matrix3d axes_of(const std::array<Eigen::Vector3d, 3>& corners) {
  const Eigen::Vector3d side = corners[1] - corners[0], normal = side.cross(corners[2] - corners[0]);
  Eigen::Matrix3d axes;
  axes << side.normalized(), normal.cross(side).normalized(), normal.normalized();
  return axes;
}

}  // namespace

std::vector<Transform<Lens, Scanner>> resect_three(const std::array<Eigen::Vector3d, 3>& rays,
                                                   const std::array<Eigen::Vector3d, 3>& points) {
  const double a2 = (points[1] - points[2]).squaredNorm(), b2 = (points[0] - points[2]).squaredNorm(),
               c2 = (points[0] - points[1]).squaredNorm();
  const double twice_area = (points[1] - points[0]).cross(points[2] - points[0]).norm();
  if (!(twice_area > 1e-4 * std::max({a2, b2, c2}))) return {};
  const double cos_a = rays[1].dot(rays[2]), cos_b = rays[0].dot(rays[2]), cos_c = rays[0].dot(rays[1]);
  const double q = (a2 - c2) / b2, sum = (a2 + c2) / b2;
  const std::array<double, 5> quartic = {
      (1 + q) * (1 + q) - 4 * a2 / b2 * cos_c * cos_c,
      4 * (-q * (1 + q) * cos_b + 2 * a2 / b2 * cos_c * cos_c * cos_b - (1 - sum) * cos_a * cos_c),
      2 * (q * q - 1 + 2 * q * q * cos_b * cos_b + 2 * (b2 - c2) / b2 * cos_a * cos_a -
           4 * sum * cos_a * cos_b * cos_c + 2 * (b2 - a2) / b2 * cos_c * cos_c),
      4 * (q * (1 - q) * cos_b - (1 - sum) * cos_a * cos_c + 2 * c2 / b2 * cos_a * cos_a * cos_b),
      (q - 1) * (q - 1) - 4 * c2 / b2 * cos_a * cos_a};
  const Eigen::Vector3d centre = (points[0] + points[1] + points[2]) / 3;
  std::vector<Transform<Lens, Scanner>> out;
  for (const double v : real_roots(quartic)) {
    const double below = 2 * (cos_c - v * cos_a);
    if (!(v > 0) || !(std::abs(below) > 1e-12)) continue;
    const double u = ((q - 1) * v * v - 2 * q * cos_b * v + 1 + q) / below;
    const double s2 = b2 / (1 + v * v - 2 * v * cos_b);
    if (!(u > 0) || !(s2 > 0)) continue;
    const double s = std::sqrt(s2);
    const std::array<Eigen::Vector3d, 3> seen = {s * rays[0], s * u * rays[1], s * v * rays[2]};
    const Eigen::Quaterniond rotation(axes_of(seen) * axes_of(points).transpose());
    const Eigen::Vector3d translation = (seen[0] + seen[1] + seen[2]) / 3 - rotation * centre;
    if (!rotation.coeffs().allFinite() || !translation.allFinite()) continue;
    out.push_back({rotation.normalized(), translation});
  }
  return out;
}

}  // namespace hueline::calibration
