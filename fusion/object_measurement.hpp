#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "core/result.hpp"

/// Objects measured in images (docs/methods equation 18): the ray of a pixel meets the surface that the laser's points
/// show there.
namespace hueline::fusion {

/// Where a picked pixel looks, in the drive's local level.
struct PickedRay {
  Eigen::Vector3d from_enu = Eigen::Vector3d::Zero();        ///< the lens's projection centre
  Eigen::Vector3d direction_enu = Eigen::Vector3d::UnitY();  ///< unit length
  double sigma = 0;  ///< rad, one standard deviation of the direction across, each way: picking, lens, mounting
};

/// A georeferenced return.
struct SurfacePoint {
  Eigen::Vector3d p_enu = Eigen::Vector3d::Zero();
  Eigen::Vector3d from_enu = Eigen::Vector3d::Zero();  ///< the scanner, when it fired
  float sigma_m = 0;  ///< as ColouredPoint::sigma_m: of pose, time and range, all axes together
  float seconds = 0;  ///< fired so long after the exposure
};

struct ObjectMeasurementConfig {
  double reach_m = 0.5;     ///< points farther from the ray take no part ...
  double reach = 0.1;       ///< ... nor those seen farther from it than this, rad
  double link_m = 0.35;     ///< points no farther apart are of one thing
  int surface_points = 12;  ///< nearest to the ray, that the surface is laid through
  double narrow_m =
      0.02;  ///< rms across the ray; points no broader than this are of a thin post or of one line of the scanner
  double most_scatter_m = 0.04;  ///< rms of the points about the surface; more is no surface (leaves, an edge)
  double most_roughness_m =
      0.10;  ///< the same of all points of the thing within a quarter of a metre: leaves are as deep as they are wide
  double most_gap_m = 0.02, most_gap = 0.005;  ///< the nearest point must be nearer to the ray than m + rad x distance:
                                               ///< between leaves there is none
  double most_oblique_deg = 85;  ///< between ray and the surface's normal; beyond, the pixel says nothing of the place
  int seen_through =
      2;  ///< so many beams went through a thing to something behind it: it is not solid, or stood there at other times
  double edge_sigma = 2.0;  ///< within so many sigma of the ray there must be one surface only
  std::string validate() const;
};

struct MeasuredObject {
  Eigen::Vector3d p_enu = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m^2
  double distance_m = 0;                                 ///< from the lens
  double oblique_deg = 0;                                ///< between ray and the surface's normal
  double scatter_m = 0;                                  ///< rms of the surface's points about it
  double seconds = 0;                                    ///< median of when they were fired, after the exposure
  int points = 0;                                        ///< of the surface
};

/// The nearest surface that covers the ray. A thing covers it if its points nearest to the ray stand around it, and no
/// beam went through it: a car that passed before or after the exposure hides nothing. Pure; reentrant. Errors:
/// Unavailable, with the reason for the user: no points, an edge (both distances are told), no surface, too oblique.
Result<MeasuredObject> measure_object(const PickedRay& ray, std::span<const SurfacePoint> points,
                                      const ObjectMeasurementConfig& config);

}  // namespace hueline::fusion
