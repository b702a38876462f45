#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "calibration/targets/ring_filter.hpp"
#include "calibration/targets/sphere_fit.hpp"

/// Detection of spheres of the right size in one ring: docs/methods/sphere_targets.md, steps 2 to 4.
namespace hueline::calibration {

/// Settings of detect_spheres().
struct DetectionConfig {
  double ring_radii = 3;          ///< thickness of a ring in radii of the largest sphere; 2 to 6, the paper has 2 to 3
  double least_roundness = 0.85;  ///< least roundness with which a linear fit counts as a target
  double most_clutter = 0.6;  ///< largest number of points beside a sphere in its ring, over the number of points on it
  std::size_t most_candidates = 250;  ///< most candidates of a ring; those with the most points are kept
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// An object that may be the target of the ring.
struct Candidate {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< from the noise of the points alone
  std::size_t points = 0;
  double roundness = 0;
};

/// The number of points, cells or fits that were left after each step.
struct DetectionCounts {
  std::size_t points = 0;      ///< points in the ring
  std::size_t cells = 0;       ///< cells with at least 4 points
  std::size_t right_size = 0;  ///< linear fits whose radius is within 2 sigma of the target's
  std::size_t round = 0;       ///< those of them that are round enough: docs/methods equation 21
  std::size_t candidates = 0;  ///< candidates without duplicates
};

/// The way in which the centre of a sphere is fitted.
enum class CentreMethod {
  LinearFit,    ///< the published method: the radius is estimated
  KnownRadius,  ///< only the centre is estimated, with weights, from the points of neighbouring cells together
};

/// The candidates of one ring.
struct RingDetection {
  DetectionCounts counts;
  std::vector<Candidate> candidates;  ///< in the order of their number of points, most points first
};

/// Finds the spheres of `radius` whose centres are at `distance` from the scanner. `points_scanner` may also contain
/// the points of other rings.
RingDetection detect_spheres(std::span<const Eigen::Vector3f> points_scanner, const Ring& ring, double distance,
                             double radius, const ScannerNoise& noise, CentreMethod method,
                             const DetectionConfig& config);

/// Returns the largest chi-squared that a fit with this many degrees of freedom may have: 1.5 times the 99.99 %
/// quantile. The factor allows for real surfaces, which are never as clean as the assumed noise.
double noise_limit(double freedom);

/// Returns the ring of a target at `distance`. `doubt_m` is the largest error of that distance.
Ring ring_of(double distance, double largest_radius, double doubt_m, const DetectionConfig& config);

}  // namespace hueline::calibration
