#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "calibration/lens/lens_values.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"

/// Space resection (docs/methods, equation 14): rotation and projection centre of a lens in the scanner's frame. No
/// start value is needed. All functions are pure.
namespace hueline::calibration {

/// One point that was measured both in the image and in the scan.
struct Correspondence {
  std::string name;                                     ///< name for reports
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();      ///< The centre of the first pixel is (0, 0).
  Eigen::Vector3d p_scanner = Eigen::Vector3d::Zero();  ///< place in the scanner's frame, m
};

/// Settings of resect().
struct ResectionConfig {
  double sigma_px = 1.0;       ///< one sigma of an image coordinate
  double sigma_point_m = 0.0;  ///< one sigma of a scanner coordinate; 0: all points have the same weight
  double agree_px = 12.0;      ///< a point whose projection is nearer than this to its pixel supports a start
  double outlier_sigma = 4.0;  ///< a point with a larger residual, in standard deviations, is left out and named
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// The pose of a lens with the residuals of its points.
struct Resection {
  Transform<Scanner, Lens>
      T_scanner_lens;  ///< The translation is the projection centre, c_scanner of docs/methods equation 14.
  /// Covariance of the rotation about the lens's own axes (rad) and of the centre along the scanner's axes (m), scaled
  /// by the residuals.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<Eigen::Vector2d> residuals;  ///< seen minus projected pixel of all points, in their order
  std::vector<bool> is_used;
  double rms_px = 0;      ///< root of the mean squared length over the points used
  double unit_sigma = 0;  ///< standard deviation of unit weight; 1 if the sigmas of the settings are correct
  /// Number of points used.
  int used = 0;
};

/// Computes the pose of `lens` from `points` with known places.
/// Errors: Invalid (fewer than four points, wrong settings), Unavailable (points on a line or all in one spot, or fewer
/// than half of the points agree). The message says which, and whether exchanged axes would fit.
Result<Resection> resect(const LensValues& lens, const std::vector<Correspondence>& points,
                         const ResectionConfig& config);

/// Returns the poses at which three rays meet three points, at most four. The solution is Grunert's, as given by
/// Haralick et al. (IJCV 13(3), 1994, section 2.1). `rays` are unit vectors in the lens frame.
std::vector<Transform<Lens, Scanner>> resect_three(const std::array<Eigen::Vector3d, 3>& rays,
                                                   const std::array<Eigen::Vector3d, 3>& points);

}  // namespace hueline::calibration
