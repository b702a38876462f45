#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "calibration/mount/fast_lens.hpp"
#include "core/time.hpp"

namespace hueline::calibration {

/// Settings of CalibrationWatch.
struct CalibrationWatchConfig {
  double window_s = 60;  ///< only exposures of the last seconds count
  double block_s = 5;    ///< length of the stretches whose differences give the uncertainty
  /// A drift is reported from these sizes on, half of what the watch has to notice. Smaller ones are never reported.
  double least_turn_deg = 0.015, least_time_ms = 0.5;
  double sigmas = 6;                 ///< a drift is reported if it is this many times its standard deviation
  double blur_px = 1.5;              ///< standard deviation of the blur of the images
  std::size_t fewest_patches = 500;  ///< with fewer in the window nothing is said
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// How far mounting and times are from what the rig says, from the exposures of one window. A vector has the rotation
/// of the head about its own axes (rad; as in corrected()) and the time to be added to the times of the images (s).
struct CalibrationDrift {
  GpsTime from{}, to{};  ///< the first and the last exposure
  HeadCorrection error = HeadCorrection::Zero();
  /// Covariance of `error`, from the differences between stretches of the window and from what all images may have in
  /// common: errors of the lenses and of the method.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  /// Change of `error` since the first full window of the drive, and its covariance. What all images have in common
  /// cancels, so that the change is more certain. Zero within the first window.
  HeadCorrection change = HeadCorrection::Zero();
  Eigen::Matrix4d change_covariance = Eigen::Matrix4d::Zero();
  std::size_t patches = 0;
  /// The error or its change is larger than its limit, and than its uncertainty allows.
  bool has_turned = false, is_late = false;
};

/// What one shot says about mounting and times.
struct WatchedShot {
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();  ///< of the squared residuals, at the rig's values
  /// How the gradient changes with rotation and time. One shot gives one column of it, four times its share.
  Eigen::Matrix4d response = Eigen::Matrix4d::Zero();
  std::size_t patches = 0;

  WatchedShot& operator+=(const WatchedShot& other);
};

/// Watches while driving whether images and laser points still fit together. Grey levels are compared with laser
/// intensities in small patches (intensity_relation.hpp), where a turned head or late images leave a gradient. How the
/// gradient answers to a small rotation or time is measured on the same images, by turning the head a little both ways:
/// the slopes of noisy images alone would make the drift look smaller than it is. The estimate is correct for small
/// drifts; of a large one it says that there is one.
///
/// Memory is that of the sums of window_s / block_s stretches. Everything depends on the exposures and their order
/// alone. Use one thread per object.
class CalibrationWatch {
 public:
  /// `lenses` and `T_body_head` are those of the rig. `config.validate()` must be empty.
  CalibrationWatch(std::vector<AlignmentLens> lenses, const Transform<Body, CameraHead>& T_body_head,
                   const CalibrationWatchConfig& config);

  /// Returns what a shot says, for a caller that computes several of them at the same time. `axis` (0 to 3) is the
  /// parameter to which the answer is measured; take them in turn. Pure.
  WatchedShot look_at(const AlignmentShot& shot, int axis) const;
  /// Adds what the shots of one exposure say. Times must not decrease; an older exposure counts as one of the newest
  /// stretch.
  void add(GpsTime exposure_mid, const WatchedShot& seen);

  /// Returns the drift in the present window; nothing while there are too few patches or fewer than six stretches.
  std::optional<CalibrationDrift> drift() const;

 private:
  struct Block {
    GpsTime from{}, to{};
    WatchedShot sum;
  };
  struct Estimate {
    HeadCorrection error;
    Eigen::Matrix4d covariance;
    std::size_t patches;
  };
  std::optional<Estimate> estimate() const;

  std::vector<AlignmentLens> lenses_;
  Transform<Body, CameraHead> T_body_head_;
  CalibrationWatchConfig config_;
  std::deque<Block> blocks_;
  std::optional<Estimate> reference_;  ///< of the first full window
};

}  // namespace hueline::calibration
