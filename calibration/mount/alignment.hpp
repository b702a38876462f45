#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "calibration/lens/board.hpp"
#include "calibration/lens/lens_values.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"

/// Calibration of a camera head's mounting without targets, from images and laser returns of many exposures.
///
/// A search first finds the rotation at which the outlines of near objects lie on image edges (Levinson and Thrun, RSS
/// 2013) and laser intensity has the most mutual information with the grey levels (Pandey et al., AAAI 2012). An
/// adjustment then fits grey levels to intensities in small patches (head_adjustment.hpp). All lenses are used together
/// with the rigid geometry of the head. The time offset of the images can be estimated with the rotation. All functions
/// are pure.
namespace hueline::calibration {

/// One laser return near an exposure, in Body at the middle of that exposure.
struct LaserSample {
  Eigen::Vector3f p_body = Eigen::Vector3f::Zero();
  float intensity = 0;  ///< equalised: 0 to 1
  float outline = 0;    ///< strength of the range jump of which the return is the near side, 0 to 1
  float apart_s = 0;    ///< time of the firing minus the middle of the exposure
};

/// One lens at one exposure. Shots are in the order of time.
struct AlignmentShot {
  /// Index into the lenses of the head.
  std::size_t lens = 0;
  GreyImage image;
  std::shared_ptr<const std::vector<LaserSample>> samples;   ///< the lenses of one exposure share them
  Eigen::Vector3d velocity_body = Eigen::Vector3d::Zero();   ///< m/s
  Eigen::Vector3d turn_rate_body = Eigen::Vector3d::Zero();  ///< rad/s
};

/// One calibrated lens of the head.
struct AlignmentLens {
  LensValues values;
  Transform<CameraHead, Lens> T_head_lens;
  double max_angle = 1.5;  ///< nothing beyond this angle from the axis is projected, rad
};

/// Settings of align_head().
struct AlignmentConfig {
  double search_deg = 3.0;  ///< largest expected error of the start, about each axis
  /// Largest expected time offset of the images. 0: the times of the images are taken as correct.
  double search_time_s = 0.0;
  bool use_outlines = true;
  bool use_intensity = true;
  bool use_relation = true;  ///< finish with the adjustment of head_adjustment.hpp
  /// Number of stretches of the drive whose differences give the standard deviations. Below 2: no standard deviations.
  int groups = 10;
  /// Called with the running stage and the share of the work that is done, 0 to 1. It may be empty.
  std::function<void(const std::string& stage, double share)> progress = {};
  /// Returns the first wrong setting with its allowed range, or an empty text.
  std::string validate() const;
};

/// The calibrated mounting of a head.
struct Alignment {
  Transform<Body, CameraHead> T_body_head;  ///< the start with a new rotation; its translation is unchanged
  double time_offset_s = 0;                 ///< to be added to the times of the images
  /// Covariance of the rotation about the head's axes (rad) and of the time offset (s), from the differences between
  /// stretches of the drive.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  /// Score of the start and of the result in the finest step of the search; larger is better.
  double score_start = 0, score = 0;
  std::size_t samples = 0, shots = 0;  ///< number of those used in the search
  /// Number of image patches that the adjustment used. 0: there was no adjustment, and the result is that of the
  /// search.
  std::size_t patches = 0;
  std::string not_adjusted;                         ///< why there was no adjustment
  Eigen::Vector4d moved = Eigen::Vector4d::Zero();  ///< change made by the adjustment: rotation (rad), time (s)
};

/// Estimates the rotation of a head from `start`, and the time offset of the images if `config` allows one.
/// Errors: Invalid (wrong settings or shots), Unavailable (no shots, too few outlines, or the best result is at the
/// edge of the search).
Result<Alignment> align_head(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                             const Transform<Body, CameraHead>& start, const AlignmentConfig& config);

/// Returns a sample for each point of a cloud, in the order of the points, with outlines and equalised intensities as
/// one scanner sees them. `p_scanner` has the scanner in its origin; the points may have any order. Returns whose
/// elevations differ by less than `same_ring_deg` are of one ring. The samples have `p_body` = p_scanner and `apart_s`
/// = 0.
std::vector<LaserSample> laser_samples(const std::vector<Eigen::Vector3f>& p_scanner,
                                       const std::vector<float>& intensity, double same_ring_deg = 0.12);

/// Returns for each intensity the share of weaker ones. Ranks are used because each scanner has its own scale of
/// intensities.
std::vector<float> ranks(const std::vector<float>& intensity);

}  // namespace hueline::calibration
