#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "core/result.hpp"

/// Measures objects in images (docs/methods, equation 18): the ray of a pixel is intersected with the surface that the
/// laser's points show there.
namespace hueline::fusion {

/// The ray of a picked pixel in the drive's local level.
struct PickedRay {
  Eigen::Vector3d from_enu = Eigen::Vector3d::Zero();        ///< the lens's projection centre
  Eigen::Vector3d direction_enu = Eigen::Vector3d::UnitY();  ///< unit length
  /// One sigma of the direction in each of the two axes across it, rad. It contains picking, lens and mounting.
  double sigma = 0;
};

/// A georeferenced return.
struct SurfacePoint {
  Eigen::Vector3d p_enu = Eigen::Vector3d::Zero();
  Eigen::Vector3d from_enu = Eigen::Vector3d::Zero();  ///< place of the scanner when it fired
  /// As ColouredPoint::sigma_m: from pose, time and range, all axes together.
  float sigma_m = 0;
  float seconds = 0;  ///< time of the firing after the exposure
};

/// Limits of measure_object(). A thing is a group of points that are linked by small steps.
struct ObjectMeasurementConfig {
  double reach_m = 0.5;     ///< points farther from the ray than this are not used
  double reach = 0.1;       ///< points seen at a larger angle from the ray than this are not used, rad
  double link_m = 0.35;     ///< points that are no farther apart than this belong to one thing
  int surface_points = 12;  ///< number of points, nearest to the ray, through which the surface is fitted
  /// Points whose rms across the ray is smaller than this belong to a thin post or to one line of the scanner.
  double narrow_m = 0.02;
  /// Largest rms of the points about the surface; more is not a surface (leaves, an edge).
  double most_scatter_m = 0.04;
  /// Largest rms about the surface of all points of the thing within a quarter of a metre; leaves are as deep as they
  /// are wide.
  double most_roughness_m = 0.10;
  /// The nearest point must be nearer to the ray than most_gap_m + most_gap (rad) x distance; between leaves there is
  /// none.
  double most_gap_m = 0.02, most_gap = 0.005;
  /// Largest angle between the ray and the surface's normal. Beyond it, the pixel does not determine the place.
  double most_oblique_deg = 85;
  /// If this many beams went through a thing to something behind it, it is not solid, or it stood there at another
  /// time.
  int seen_through = 2;
  /// Within this many sigma around the ray there must be only one surface.
  double edge_sigma = 2.0;
  std::string validate() const;
};

/// The measured place of an object.
struct MeasuredObject {
  Eigen::Vector3d p_enu = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m^2
  double distance_m = 0;                                 ///< from the lens
  double oblique_deg = 0;                                ///< angle between the ray and the surface's normal
  double scatter_m = 0;                                  ///< rms of the surface's points about it
  double seconds = 0;  ///< median firing time of the surface's points, after the exposure
  int points = 0;      ///< number of points of the surface
};

/// Returns the nearest surface that covers the ray. A thing covers the ray if its points nearest to the ray stand
/// around it and no beam went through it; so a car that passed before or after the exposure hides nothing. Thread-safe.
/// Errors: Unavailable, with the reason for the user: there are no points, there is an edge (with both distances),
/// there is no surface, or the surface is too oblique.
Result<MeasuredObject> measure_object(const PickedRay& ray, std::span<const SurfacePoint> points,
                                      const ObjectMeasurementConfig& config);

}  // namespace hueline::fusion
