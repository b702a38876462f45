#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/lens/lens_adjustment.hpp"

/// Views of a board in, a calibrated lens out: docs/methods/lens_registration.md, section 1, for plane and for fisheye
/// lenses.
namespace hueline::calibration {

struct LensCalibrationConfig {
  std::optional<LensModel> model;   ///< empty: the one that predicts views best that it was not fitted to
  bool one_focal = false;           ///< square pixels
  double corner_limit_sigma = 4.5;  ///< a corner farther off is left out; 1 of 25 000 good ones would be
  double view_limit = 3.0;          ///< a view whose rms is so many times the median of the views' is left out
  int folds = 5;                    ///< of the cross-validation
  std::string validate() const;
};

struct RejectedCorner {
  std::string view;
  std::size_t index = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double error_px = 0;
};
struct RejectedView {
  std::string view;
  std::string why;
};
/// One model tried.
struct ModelTrial {
  LensModel model = LensModel::Brown;
  double rms_px = 0;  ///< of the fit
  /// Of views held back, posed by every other corner and judged by the rest. Empty: not measured, because the views are
  /// too few to hold any back, or because of `unpredicted`.
  std::optional<double> predicted_rms_px;
  std::vector<RejectedView>
      unpredicted;      ///< held-back views that the lens fitted to the others cannot pose or project: it fails there
  std::string failure;  ///< why it could not be fitted; empty: it could

  /// In words: what was measured, or why not. One line.
  std::string words() const;
};

struct LensCalibration {
  Board board;
  std::vector<BoardView> views;  ///< those used, with the corners used
  AdjustedLens adjusted;
  std::vector<RejectedView> rejected_views;
  std::vector<RejectedCorner> rejected_corners;
  std::vector<ModelTrial> trials;
};

/// `width`, `height`: of the images. A model that cannot pose views it was not fitted to is not chosen; asked for by
/// name, it is fitted and its trial says so. Errors: Invalid (fewer than three views, board or settings), Unavailable
/// (with the reason: no model fits, or none predicts).
Result<LensCalibration> calibrate_lens(const Board& board, const std::vector<BoardView>& views, std::uint32_t width,
                                       std::uint32_t height, const LensCalibrationConfig& config);

}  // namespace hueline::calibration
