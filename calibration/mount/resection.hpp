#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "calibration/lens/lens_values.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"

/// Docs/methods equation 14: rotation and projection centre of a lens in the scanner's frame by space resection. No
/// guess of either is needed. Pure functions.
namespace hueline::calibration {

/// One point seen by both.
struct Correspondence {
  std::string name;                                     ///< for people
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();      ///< centres at whole numbers
  Eigen::Vector3d p_scanner = Eigen::Vector3d::Zero();  ///< m
};

struct ResectionConfig {
  double sigma_px = 1.0;       ///< of an image coordinate
  double sigma_point_m = 0.0;  ///< of a scanner coordinate; 0: all points weigh the same
  double agree_px = 12.0;      ///< a point this near to where a start puts it speaks for that start
  double outlier_sigma = 4.0;  ///< farther off than so many standard deviations: left out and named
  std::string validate() const;
};

struct Resection {
  Transform<Scanner, Lens>
      T_scanner_lens;  ///< its translation is the projection centre, c_scanner of docs/methods equation 14
  /// Turn about the lens's own axes (rad), then centre along the scanner's axes (m); scaled by the residuals.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<Eigen::Vector2d> residuals;  ///< seen minus projected, px, of all points in their order
  std::vector<bool> is_used;
  double rms_px = 0;      ///< root of the mean square length over the points used
  double unit_sigma = 0;  ///< standard deviation of unit weight: 1 where the sigmas of the settings are true
  int used = 0;
};

/// Errors: Invalid (fewer than four points, settings), Unavailable: geometry that fixes nothing (points on a line, or
/// all in one spot), or fewer than half of the points that agree; the message says which, and whether exchanged axes
/// would fit.
Result<Resection> resect(const LensValues& lens, const std::vector<Correspondence>& points,
                         const ResectionConfig& config);

/// Poses from which three rays meet three points: Grunert's equations as Haralick et al. give them (IJCV 13(3), 1994,
/// section 2.1), up to four. `rays`: unit, lens frame.
std::vector<Transform<Lens, Scanner>> resect_three(const std::array<Eigen::Vector3d, 3>& rays,
                                                   const std::array<Eigen::Vector3d, 3>& points);

}  // namespace hueline::calibration
