#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "core/frames.hpp"

/// Fits of spheres to the points of a static scan. Points are float coordinates in the scanner's own frame, as scanners
/// deliver them.
namespace hueline::calibration {

/// One sigma of a scanner's measurements. The defaults are those of a RIEGL VZ-1000: accuracy 8 mm and precision 5 mm
/// from its data sheet, and twice its angular resolution of 0.0005 deg.
struct ScannerNoise {
  double range_precision_m = 0.005;  ///< independent from point to point
  /// The whole range error. The part that precision does not explain is common to the points of one target.
  double range_accuracy_m = 0.008;
  double angle_rad = 17.5e-6;  ///< each of the two angles, independent from point to point

  /// Returns the sigma along the line of sight that does not decrease with the number of points.
  double common_range_sigma_m() const;
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// How many points of a target are needed to find it.
constexpr std::size_t kFewestOnTarget = 4;

/// A sphere with an estimated radius.
struct SphereFit {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  double radius = 0;
  /// 1 - mean |distance to the surface| / radius (docs/methods equation 21). 1 is perfectly round.
  double roundness = 0;
};

/// Fits x^2 + y^2 + z^2 + A x + B y + C z + D = 0 by linear least squares about the mean of the points (docs/methods
/// equation 20). No start value is needed. Returns nothing for fewer than 4 points or points in a plane. The radius is
/// biased if there are few noisy points on one side; fit_known_radius avoids this.
std::optional<SphereFit> fit_linear(std::span<const Eigen::Vector3f> points_scanner);

/// The centre of a sphere with a known radius.
struct CentreFit {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  /// From the points' own noise, without the common part of the range error.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::size_t points = 0;  ///< number of points used
  double chi_squared = 0;  ///< sum of (distance to the surface / sigma)^2; its expectation is points - 3
  double roundness = 0;
};

/// Fits the centre by maximum likelihood under `noise`. The weight of a distance to the surface follows from the range
/// and angle noise at the beam's angle of incidence, and the second-order bias of the distance is removed.
/// Left out are points farther than `gate` sigmas from the surface, points on the far side, and, if enough others
/// remain, points on the underside, where the stand of the sphere is. The fit is repeated until no point changes.
/// Returns nothing for fewer than 4 points, or if the points do not determine a centre near `start_scanner`.
std::optional<CentreFit> fit_known_radius(std::span<const Eigen::Vector3f> points_scanner, double radius,
                                          const Eigen::Vector3d& start_scanner, const ScannerNoise& noise,
                                          double gate = 4.0);

/// What is known about a centre before its points are used.
struct CentrePrior {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// Fits the centre like fit_known_radius when few points allow more than one centre. The points are selected, and the
/// surface is linearised, about the centre that fits both the points and `prior`. The returned centre is that of the
/// points alone. `chi_squared` is that of both at this centre; its expectation is the number of points.
std::optional<CentreFit> fit_known_radius_near(std::span<const Eigen::Vector3f> points_scanner, double radius,
                                               const CentrePrior& prior, const ScannerNoise& noise, double gate = 4.0);

/// Returns the centre for points that cover the visible disc evenly. This start needs no guess.
Eigen::Vector3d start_of_centre(std::span<const Eigen::Vector3f> points_scanner, double radius);

}  // namespace hueline::calibration
