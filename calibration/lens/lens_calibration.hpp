#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/lens/lens_adjustment.hpp"
#include "calibration/lens/two_lenses.hpp"

/// Calibration of a lens, plane or fisheye, from images of a board: docs/methods/lens_registration.md, section 1.
namespace hueline::calibration {

/// Settings of calibrate_lens().
struct LensCalibrationConfig {
  std::optional<LensModel> model;  ///< Empty: the model is used that best predicts views to which it was not fitted.
  bool one_focal = false;          ///< one focal length for both axes (square pixels)
  /// A corner with a larger error, in sigmas, is left out. Of good corners this concerns 1 in 25 000.
  double corner_limit_sigma = 4.5;
  double view_limit = 3.0;  ///< a view is left out if its rms is more than this many times the median of all views
  int folds = 5;            ///< number of parts of the cross-validation
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// A corner that was left out.
struct RejectedCorner {
  std::string view;
  std::size_t index = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double error_px = 0;
};
/// A view that was left out, and why.
struct RejectedView {
  std::string view;
  std::string why;
};
/// The result of one lens model.
struct ModelTrial {
  LensModel model = LensModel::Brown;
  double rms_px = 0;  ///< rms of the fit
  /// Rms of held-back views: every other corner gives the pose of the view, and the remaining corners give the error.
  /// Empty if it was not measured, because there are too few views or because of `unpredicted`.
  std::optional<double> predicted_rms_px;
  /// Held-back views that cannot be posed or projected by the lens that was fitted to the other views. The model fails
  /// on them.
  std::vector<RejectedView> unpredicted;
  std::string failure;  ///< why the model could not be fitted; empty if it could

  /// Returns one line that says what was measured, or why nothing was.
  std::string words() const;
};

/// A calibrated lens with everything that led to it.
struct LensCalibration {
  Board board;                   ///< with its bend, if the views show that it has one
  std::vector<BoardView> views;  ///< the views used, with the corners used
  AdjustedLens adjusted;
  std::vector<RejectedView> rejected_views;
  std::vector<RejectedCorner> rejected_corners;
  std::vector<ModelTrial> trials;
  std::optional<TwoLenses> two_lenses;  ///< the result is a mean of two lenses; empty if the views are of one

  bool is_bent() const { return board.bend_m != std::array<double, kBendTerms>{}; }
};

/// Calibrates a lens from views of `board`. `width` and `height` are the size of the images in pixels.
///
/// A board that is not plane moves the lens in all views alike, by more than the sigmas say. If the views show that the
/// board is bent, its bend (Board::bend_m) is adjusted together with the lens.
///
/// A model that cannot pose views to which it was not fitted is not chosen. If `config` names that model, it is fitted
/// nevertheless and its trial says so.
/// Errors: Invalid (fewer than three views, wrong board or settings), Unavailable (no model fits, or none predicts; the
/// message says why).
Result<LensCalibration> calibrate_lens(const Board& board, const std::vector<BoardView>& views, std::uint32_t width,
                                       std::uint32_t height, const LensCalibrationConfig& config);

}  // namespace hueline::calibration
