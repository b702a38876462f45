#include "calibration/targets/sphere_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace hueline::calibration {
namespace {

// A normal that is steeper than this points to the stand of the sphere: it is within 26 degrees of straight down.
constexpr double kMount = -0.9;

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3f> points_scanner) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points_scanner) sum += p.cast<double>();
  return sum / static_cast<double>(points_scanner.size());
}

/// The noise of a point's distance to the surface.
struct PointNoise {
  double variance;  // variance of the distance
  double bias;      // mean of the distance: noise along the surface moves a point outward, in second order
};

/// Returns the noise of a distance. `cos_incidence` is the cosine between the beam and the surface's normal. Range
/// noise moves a point along the beam, angle noise across it.
PointNoise noise_at(double cos_incidence, double range_m, double radius, const ScannerNoise& noise) {
  const double along = noise.range_precision_m * noise.range_precision_m;
  const double across = range_m * range_m * noise.angle_rad * noise.angle_rad;
  const double c2 = cos_incidence * cos_incidence, s2 = 1 - c2;
  return {c2 * along + s2 * across, (s2 * along + (1 + c2) * across) / (2 * radius)};
}

}  // namespace

double ScannerNoise::common_range_sigma_m() const {
  return std::sqrt(std::max(0.0, range_accuracy_m * range_accuracy_m - range_precision_m * range_precision_m));
}

std::string ScannerNoise::validate() const {
  if (!(range_precision_m > 0 && range_precision_m <= 0.1))
    return fmt::format("range_precision_m is {}; allowed: above 0, up to 0.1", range_precision_m);
  if (!(range_accuracy_m >= range_precision_m && range_accuracy_m <= 0.1))
    return fmt::format("range_accuracy_m is {}; allowed: from range_precision_m ({}) to 0.1", range_accuracy_m,
                       range_precision_m);
  if (!(angle_rad >= 0 && angle_rad <= 0.001)) return fmt::format("angle_rad is {}; allowed: 0 to 0.001", angle_rad);
  return {};
}

std::optional<SphereFit> fit_linear(std::span<const Eigen::Vector3f> points_scanner) {
  if (points_scanner.size() < kFewestOnTarget) return {};
  const auto n = static_cast<double>(points_scanner.size());
  const Eigen::Vector3d mean = mean_of(points_scanner);
  // About the mean the constant D separates, and three equations remain: M c = v / 2.
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const auto& p : points_scanner) {
    const Eigen::Vector3d q = p.cast<double>() - mean;
    M += q * q.transpose();
    v += q * q.squaredNorm();
    squares += q.squaredNorm();
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(M);
  const double pivot = solver.vectorD().minCoeff();
  if (!(pivot > 1e-9 * M.trace())) return {};
  const Eigen::Vector3d centre = solver.solve(v) / 2;
  SphereFit fit;
  fit.radius = std::sqrt(squares / n + centre.squaredNorm());
  fit.centre_scanner = mean + centre;
  double away = 0;
  for (const auto& p : points_scanner) away += std::abs((p.cast<double>() - fit.centre_scanner).norm() - fit.radius);
  fit.roundness = 1 - away / n / fit.radius;
  return fit;
}

Eigen::Vector3d start_of_centre(std::span<const Eigen::Vector3f> points_scanner, double radius) {
  const Eigen::Vector3d mean = mean_of(points_scanner);
  // The mean of an evenly covered visible disc lies 2/3 of the radius in front of the centre.
  return mean * (1 + radius * (2.0 / 3.0) / mean.norm());
}

namespace {

/// The normal equations of all points for one centre.
struct SphereLook {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  std::size_t points = 0;
  double chi_squared = 0, away = 0;
};

/// Computes the normal equations for a centre. Points within `loose` of the surface are used even if the gate is
/// narrower.
SphereLook look_from(const Eigen::Vector3d& centre, std::span<const Eigen::Vector3f> points_scanner, double radius,
                     const ScannerNoise& noise, double gate, double loose, bool without_mount) {
  SphereLook look;
  for (const auto& point : points_scanner) {
    const Eigen::Vector3d p = point.cast<double>(), from_centre = p - centre;
    const double distance = from_centre.norm(), range = p.norm();
    if (distance < 1e-6 || range < 1e-6) continue;
    const Eigen::Vector3d normal = from_centre / distance;
    const double cos_incidence = -normal.dot(p) / range;
    if (cos_incidence < -0.2 || (without_mount && normal.z() < kMount)) continue;
    const PointNoise at = noise_at(cos_incidence, range, radius, noise);
    const double residual = distance - radius - at.bias;
    if (std::abs(residual) > std::max(loose, gate * std::sqrt(at.variance))) continue;
    ++look.points;
    look.information += normal * normal.transpose() / at.variance;
    look.pull += normal * (residual / at.variance);
    look.chi_squared += residual * residual / at.variance;
    look.away += std::abs(distance - radius);
  }
  return look;
}

/// Iterates either fit: the gate narrows down to the noise while the centre converges. `prior` may be null.
std::optional<CentreFit> settle(std::span<const Eigen::Vector3f> points_scanner, double radius,
                                const Eigen::Vector3d& start, const ScannerNoise& noise, double gate, double loose,
                                const CentrePrior* prior, bool without_mount) {
  if (points_scanner.size() < kFewestOnTarget || !(start.norm() > radius)) return {};
  const Eigen::Matrix3d known = prior ? Eigen::Matrix3d(prior->covariance.inverse()) : Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
  Eigen::Vector3d centre = start;
  constexpr int kMostSteps = 60;
  for (int step = 0; step < kMostSteps; ++step) {
    const SphereLook look = look_from(centre, points_scanner, radius, noise, gate, loose, without_mount);
    if (look.points < kFewestOnTarget) return {};
    const Eigen::Vector3d off = prior ? Eigen::Vector3d(prior->centre_scanner - centre) : Eigen::Vector3d::Zero();
    // A few near-parallel normals hardly determine the centre sideways. The radius damps it until it has converged.
    const double damping = loose > 0 ? 4 / (radius * radius) : 0;
    const Eigen::LDLT<Eigen::Matrix3d> solver(look.information + known + damping * unit);
    if (!(solver.vectorD().minCoeff() > 1 / (radius * radius))) return {};
    Eigen::Vector3d move = solver.solve(look.pull + known * off);
    if (move.norm() > radius / 2) move *= radius / 2 / move.norm();
    if (move.norm() < 1e-6 && loose == 0) {
      const Eigen::LDLT<Eigen::Matrix3d> alone(look.information);
      if (!(alone.vectorD().minCoeff() > 0.01 / (radius * radius))) return {};
      CentreFit fit;
      fit.points = look.points;
      fit.centre_scanner = prior ? Eigen::Vector3d(centre + alone.solve(look.pull)) : centre;
      fit.covariance = alone.solve(unit);
      fit.chi_squared = look.chi_squared + off.dot(known * off);
      fit.roundness = 1 - look.away / static_cast<double>(look.points) / radius;
      return fit;
    }
    centre += move;
    if ((centre - start).norm() > 3 * radius) return {};
    loose = loose > noise.range_precision_m ? 0.75 * loose : 0;
  }
  return {};
}

}  // namespace

std::optional<CentreFit> fit_known_radius(std::span<const Eigen::Vector3f> points_scanner, double radius,
                                          const Eigen::Vector3d& start_scanner, const ScannerNoise& noise,
                                          double gate) {
  const auto fit = settle(points_scanner, radius, start_scanner, noise, gate, 0.6 * radius, nullptr, true);
  return fit ? fit : settle(points_scanner, radius, start_scanner, noise, gate, 0.6 * radius, nullptr, false);
}

std::optional<CentreFit> fit_known_radius_near(std::span<const Eigen::Vector3f> points_scanner, double radius,
                                               const CentrePrior& prior, const ScannerNoise& noise, double gate) {
  const auto fit = settle(points_scanner, radius, prior.centre_scanner, noise, gate, 0.5 * radius, &prior, true);
  return fit ? fit : settle(points_scanner, radius, prior.centre_scanner, noise, gate, 0.5 * radius, &prior, false);
}

}  // namespace hueline::calibration
