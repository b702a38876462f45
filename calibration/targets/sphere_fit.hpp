#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>

#include "core/frames.hpp"

/// Spheres through the points of a static scan. Points are float offsets from the scanner, in its own frame, as
/// scanners deliver them.
namespace hueline::calibration {

/// One sigma of a scanner's measurement. Defaults: RIEGL VZ-1000 (data sheet: accuracy 8 mm, precision 5 mm), angles
/// doubled from its resolution of 0.0005 deg.
struct ScannerNoise {
  double range_precision_m = 0.005;  ///< from point to point
  double range_accuracy_m =
      0.008;                   ///< all of it: what precision does not explain is common to the points of one target
  double angle_rad = 17.5e-6;  ///< each of the two angles, from point to point

  /// What stays however many points hit a target, along the line of sight.
  double common_range_sigma_m() const;
  /// Empty when fine.
  std::string validate() const;
};

/// A sphere with its radius estimated.
struct SphereFit {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  double radius = 0;
  /// 1 - mean |distance to the surface| / radius (docs/methods equation 21). 1: perfectly round.
  double roundness = 0;
};

/// x^2 + y^2 + z^2 + A x + B y + C z + D = 0 by linear least squares, about the points' mean (docs/methods equation
/// 20); no start values. Empty if there are fewer than 4 points or they lie in a plane. With few noisy points on one
/// side the radius is biased: see fit_known_radius.
std::optional<SphereFit> fit_linear(std::span<const Eigen::Vector3f> points_scanner);

/// A sphere whose radius is known: the centre alone.
struct CentreFit {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  /// Of the points' own noise; the common part of the range is not in it.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::size_t points = 0;  ///< used
  double chi_squared = 0;  ///< sum of squared distances to the surface, each over its sigma; expectation: points - 3
  double roundness = 0;
};

/// Maximum likelihood under `noise`: distances to the surface are weighted by what range and angle noise make of them
/// where the beam meets the surface, less their second-order bias. Points farther than `gate` sigma from the surface,
/// on the far side, or - where enough others are left - below, where the sphere's stand is, are left out and the rest
/// fitted again until none changes. Empty with fewer than 4 points, or when they do not determine a centre near
/// `start`.
std::optional<CentreFit> fit_known_radius(std::span<const Eigen::Vector3f> points_scanner, double radius,
                                          const Eigen::Vector3d& start_scanner, const ScannerNoise& noise,
                                          double gate = 4.0);

/// What is known of a centre before its points are looked at.
struct CentrePrior {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// The same where few points leave more than one centre possible: points are chosen and the surface is taken for flat
/// about the centre that suits both them and `prior`. The centre returned is what the points alone say from there;
/// chi_squared is of both at that centre, expectation: points.
std::optional<CentreFit> fit_known_radius_near(std::span<const Eigen::Vector3f> points_scanner, double radius,
                                               const CentrePrior& prior, const ScannerNoise& noise, double gate = 4.0);

/// Where the centre is if the points are a fair sample of the visible disc: the start that needs no guess.
Eigen::Vector3d start_of_centre(std::span<const Eigen::Vector3f> points_scanner, double radius);

}  // namespace hueline::calibration
