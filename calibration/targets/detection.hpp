#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/targets/ring_filter.hpp"
#include "calibration/targets/sphere_fit.hpp"

/// Spheres of the right size in one ring: docs/methods/sphere_targets.md, steps 2 to 4.
namespace hueline::calibration {

struct DetectionConfig {
  double ring_radii = 3;              ///< thickness of a ring in radii of the largest sphere: 2 to 3
  double least_roundness = 0.85;      ///< of what the linear fit takes for a target
  double most_clutter = 0.6;          ///< points beside a sphere, in its ring, against points on it
  std::size_t most_candidates = 250;  ///< kept of a ring, those of the most points
  std::string validate() const;
};

/// Something that looks like the ring's target.
struct Candidate {
  Eigen::Vector3d centre_scanner = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of point noise
  std::size_t points = 0;
  double roundness = 0;
};

/// How many were left after each step.
struct DetectionCounts {
  std::size_t points = 0;      ///< in the ring
  std::size_t cells = 0;       ///< with at least 4 points
  std::size_t right_size = 0;  ///< linear fits whose radius is within 2 sigma of the target's
  std::size_t round = 0;       ///< of those, the round ones: docs/methods equation 21
  std::size_t candidates = 0;  ///< without duplicates
};

enum class CentreMethod {
  LinearFit,    ///< as published: radius estimated
  KnownRadius,  ///< centre alone, over joined cells, weighted
};

struct RingDetection {
  DetectionCounts counts;
  std::vector<Candidate> candidates;  ///< those of the most points first
};

/// `points_scanner` may hold other rings' points as well.
RingDetection detect_spheres(std::span<const Eigen::Vector3f> points_scanner, const Ring& ring, double distance,
                             double radius, const ScannerNoise& noise, CentreMethod method,
                             const DetectionConfig& config);

/// Below it chi-squared of this many degrees of freedom stays in 99.99 % of cases, times a half more: surfaces are
/// never as clean as noise.
double noise_limit(double freedom);

/// The ring of a target at this distance; `doubt_m`: how wrong the distance may be.
Ring ring_of(double distance, double largest_radius, double doubt_m, const DetectionConfig& config);

}  // namespace hueline::calibration
