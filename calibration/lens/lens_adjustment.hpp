#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "calibration/lens/lens_start.hpp"
#include "core/result.hpp"

namespace hueline::calibration {

/// Settings of adjust_lens().
struct LensAdjustmentConfig {
  bool one_focal = false;  ///< one focal length for both axes (square pixels)
  bool is_bent = false;    ///< the board's bend_m is adjusted, too
  double robust_px = 0;    ///< width of a Cauchy loss, px; 0: least squares
  int max_iterations = 200;
};

/// The maximum-likelihood lens and board poses.
struct AdjustedLens {
  LensValues lens;
  std::array<double, kBendTerms> bend_m{};              ///< Board::bend_m
  std::vector<BoardPose> poses;                         ///< poses of the board, in the order of the views
  std::vector<std::vector<Eigen::Vector2d>> residuals;  ///< seen minus projected pixel of each view's corners
  double rms_px = 0;    ///< root of the mean squared length of the residuals, as OpenCV prints it
  double sigma_px = 0;  ///< standard deviation of one pixel coordinate: sqrt(sum of squares / redundancy)
  int observations = 0, unknowns = 0;
  /// Final cost of the solver: half the sum of the squared residuals, after the robust loss if there is one.
  double cost = 0;
  /// How far the views pull the lens in different directions, divided by how far the noise of independent corners would
  /// make them (root mean square over the parameters). 1: there is nothing but that noise. Photographs have 1.2 to 3.
  double disagreement = 1;
  /// How strongly each view pulls the lens to one side or the other along the direction in which the views disagree
  /// most. Their signs part the views of two lenses.
  std::vector<double> pulls;
  /// One sigma of the focal lengths by the noise of independent corners alone, px.
  Eigen::Vector2d focal_noise_px = Eigen::Vector2d::Zero();
  /// Covariance of LensValues::parameters() by the disagreement of the views, and at least sigma_px squared times the
  /// inverse normal matrix, from which the poses (and the bend of the board) are eliminated. Fixed parameters have 0.
  Eigen::Matrix<double, kLensParameters, kLensParameters> covariance =
      Eigen::Matrix<double, kLensParameters, kLensParameters>::Zero();
};

/// Adjusts the lens and the pose of each view together (bundle adjustment), from `start`. Ceres runs in one thread, so
/// that the same input gives the same bytes.
/// Errors: Invalid (no start for the pose of a view, or too few corners), Unavailable (no convergence, or the views
/// leave a parameter undetermined).
Result<AdjustedLens> adjust_lens(const Board& board, std::span<const BoardView> views, const LensValues& start,
                                 const LensAdjustmentConfig& config);

/// Returns the pose of one view with a fixed lens: a linear start, then least squares. Returns nothing if there is no
/// start.
std::optional<BoardPose> resect_board(const Board& board, const BoardView& view, const LensValues& lens);

}  // namespace hueline::calibration
