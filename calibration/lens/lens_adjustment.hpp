#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/lens/lens_start.hpp"
#include "core/result.hpp"

namespace hueline::calibration {

struct LensAdjustmentConfig {
  bool one_focal = false;  ///< square pixels: one focal length for both axes
  double robust_px = 0;    ///< Cauchy loss of this width, px; 0: least squares
  int max_iterations = 200;
};

/// What maximum likelihood over lens and boards gave.
struct AdjustedLens {
  LensValues lens;
  std::vector<BoardPose> poses;                         ///< of the views, in their order
  std::vector<std::vector<Eigen::Vector2d>> residuals;  ///< seen minus projected, px, of each view's corners
  double rms_px = 0;    ///< root of the mean square length of the residuals (what OpenCV prints)
  double sigma_px = 0;  ///< standard deviation of one pixel coordinate: root of (sum of squares / redundancy)
  int observations = 0, unknowns = 0;
  double cost = 0;
  /// Of LensValues::parameters(), from sigma_px and the inverse normal matrix with the poses eliminated; fixed ones
  /// have 0.
  Eigen::Matrix<double, kLensParameters, kLensParameters> covariance =
      Eigen::Matrix<double, kLensParameters, kLensParameters>::Zero();
};

/// Bundle adjustment from `start`: lens and the pose of each view together. Ceres, one thread: the same input gives the
/// same bytes. Errors: Invalid (a view's pose cannot be started, too few corners), Unavailable (no convergence, or the
/// views leave a parameter open).
Result<AdjustedLens> adjust_lens(const Board& board, std::span<const BoardView> views, const LensValues& start,
                                 const LensAdjustmentConfig& config);

/// Pose of one view with the lens held fixed: linear start, then least squares. Empty where it cannot be started.
std::optional<BoardPose> resect_board(const Board& board, const BoardView& view, const LensValues& lens);

}  // namespace hueline::calibration
