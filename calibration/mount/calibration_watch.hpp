#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "calibration/mount/fast_lens.hpp"
#include "core/keys.hpp"
#include "core/time.hpp"

namespace hueline::calibration {

/// Settings of CalibrationWatch, and of runtime::DriveWatch, which feeds it. Only those of `visit` are keys of a rig.
struct CalibrationWatchConfig {
  /// So many lens images are looked at. 0: the watch is off, as long as the rate of its false alarms is not known
  /// better.
  double images_per_s = 0;
  double window_s = 45;  ///< the images of the last seconds are held against those before them
  /// A drift is reported from these sizes on, half of what the watch has to notice. Smaller ones are never reported.
  double least_turn_deg = 0.015, least_time_ms = 0.5;
  /// A drift is reported if it is as improbable as this many standard deviations of a normal distribution.
  double sigmas = 4.5;
  double block_s = 3;                ///< length of the stretches whose differences give the uncertainty
  double reference_s = 300;          ///< so much of the beginning of the drive is what later windows are compared with
  double history_s = 300;            ///< stretches of so long give the uncertainty
  double blur_px = 1.5;              ///< standard deviation of the blur of the images
  std::size_t fewest_patches = 500;  ///< with fewer in the window nothing is said

  void visit(Keys& keys);
  KeyError validate() const;
};

/// How far mounting and times are from what the rig says, from the exposures of one window. A vector has the rotation
/// of the head about its own axes (rad; as in corrected()) and the time to be added to the times of the images (s).
struct CalibrationDrift {
  GpsTime from{}, to{};  ///< the first and the last exposure of the window
  HeadCorrection error = HeadCorrection::Zero();
  /// Covariance of `error`, from the differences between stretches of the drive and from what all images may have in
  /// common: errors of the lenses and of the method.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  /// Change of `error` since the beginning of the drive, and its covariance. Most of what all images have in common
  /// cancels, so that the change is more certain. Zero while there is nothing to compare with.
  HeadCorrection change = HeadCorrection::Zero();
  Eigen::Matrix4d change_covariance = Eigen::Matrix4d::Zero();
  std::size_t patches = 0;
  /// A drift has to be so many standard deviations: more than `sigmas` while few stretches tell what the standard
  /// deviation is.
  double needed_sigmas = 0;
  /// The error or its change is larger than its limit, and than its uncertainty allows.
  bool has_turned = false, is_late = false;
  bool has_changed = false;  ///< the change of one of them is
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
/// Stretches of block_s are summed. The last window_s of them are compared with the rig, and with the first reference_s
/// of the drive. The differences of neighbouring stretches give the uncertainty, so that a drift does not make itself
/// uncertain.
///
/// Memory is that of the sums of (window_s + history_s) / block_s stretches. Everything depends on the exposures and
/// their order alone. Use one thread per object.
class CalibrationWatch {
 public:
  /// `lenses` and `T_body_head` are those of the rig. `config.validate()` must be empty.
  CalibrationWatch(std::vector<AlignmentLens> lenses, const Transform<Body, CameraHead>& T_body_head,
                   const CalibrationWatchConfig& config);

  /// Returns what a shot says, for a caller that computes several of them at the same time. `axis` (0 to 3) is the
  /// parameter to which the answer is measured; take them in turn. Pure.
  WatchedShot look_at(const AlignmentShot& shot, int axis) const;
  /// Adds what the shots of one exposure say. Times must not decrease; an older exposure counts as one of the newest
  /// stretch. Returns true if this completed a stretch, so that drift() is new.
  bool add(GpsTime exposure_mid, const WatchedShot& seen);

  /// Returns the drift in the present window of whole stretches; nothing while the window is not full or has too few
  /// patches. It changes when a stretch is complete. A drift that was reported stays one until it is below half of its
  /// limit.
  const std::optional<CalibrationDrift>& drift() const { return drift_; }

 private:
  struct Block {
    GpsTime from{}, to{};
    WatchedShot sum;
    bool has_left = false;  // the window
  };
  void complete_block();
  std::size_t window_begin() const;
  struct Scatter {
    Eigen::Matrix4d of_patch;  // covariance that the gradient of one patch would have
    double freedom = 0;        // degrees of freedom of this estimate
  };
  Scatter scatter() const;
  std::optional<CalibrationDrift> judge() const;
  bool is_beyond(const HeadCorrection& by, const Eigen::Matrix4d& covariance, double sigmas, int axis) const;

  std::vector<AlignmentLens> lenses_;
  Transform<Body, CameraHead> T_body_head_;
  CalibrationWatchConfig config_;
  std::deque<Block> blocks_;      // whole stretches
  std::optional<Block> filling_;  // the newest
  WatchedShot reference_;         // sum of stretches of the beginning
  std::size_t reference_blocks_ = 0;
  bool is_reference_closed_ = false;
  std::optional<CalibrationDrift> drift_;
};

}  // namespace hueline::calibration
