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

/// Where a camera head sits, without targets: image and laser of many exposures are laid over each other until outlines
/// of near things lie on edges of the image (Levinson and Thrun, RSS 2013) and laser intensity tells most about grey
/// levels (mutual information: Pandey et al., AAAI 2012); then grey levels are adjusted to intensities patch by patch
/// (head_adjustment.hpp). All lenses at once with the head's rigid geometry; the time offset of the images with it.
/// Pure functions.
namespace hueline::calibration {

/// One laser return near an exposure, in Body at the middle of that exposure.
struct LaserSample {
  Eigen::Vector3f p_body = Eigen::Vector3f::Zero();
  float intensity = 0;  ///< 0 to 1
  float outline = 0;    ///< 0 to 1: how much it is the near side of a jump of range
  float apart_s = 0;    ///< fired so long after the exposure
};

/// One lens at one exposure. Shots stand in order of time.
struct AlignmentShot {
  std::size_t lens = 0;
  GreyImage image;
  std::shared_ptr<const std::vector<LaserSample>> samples;   ///< the lenses of one exposure share them
  Eigen::Vector3d velocity_body = Eigen::Vector3d::Zero();   ///< m/s
  Eigen::Vector3d turn_rate_body = Eigen::Vector3d::Zero();  ///< rad/s
};

/// One lens of the head, calibrated.
struct AlignmentLens {
  LensValues values;
  Transform<CameraHead, Lens> T_head_lens;
  double max_angle = 1.5;  ///< rad from the axis; nothing beyond is projected
};

struct AlignmentConfig {
  double search_deg = 3.0;     ///< how far off the start may be, about each axis
  double search_time_s = 0.0;  ///< and in time; 0: the images' times are taken for true
  bool use_outlines = true;
  bool use_intensity = true;
  bool use_relation = true;  ///< end with the adjustment of grey levels to intensities (head_adjustment.hpp)
  /// Stretches of the shots whose disagreement gives the standard deviations; below 2: none.
  int groups = 10;
  std::function<void(const std::string& stage, double share)> progress = {};  ///< told how far it has come
  std::string validate() const;
};

struct Alignment {
  Transform<Body, CameraHead> T_body_head;  ///< the start, turned; its place is left as it was
  double time_offset_s = 0;                 ///< add it to the times of the images
  /// From the disagreement of stretches of shots: turn about the head's axes (rad), time (s).
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double score_start = 0, score = 0;   ///< of the finest step of the search; larger is better
  std::size_t samples = 0, shots = 0;  ///< used in the search
  std::size_t patches = 0;   ///< of images that the adjustment used; 0: there was none, the search's end is the result
  std::string not_adjusted;  ///< why there was none
  Eigen::Vector4d moved = Eigen::Vector4d::Zero();  ///< by the adjustment: turn (rad), time (s)
};

/// Errors: Invalid (settings), Unavailable (too few outlines, or no better place than the edge of the search).
Result<Alignment> align_head(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                             const Transform<Body, CameraHead>& start, const AlignmentConfig& config);

/// Outlines and equalised intensities of a cloud as one scanner sees it. `p_scanner` with the scanner in the origin;
/// any order. The result has the order of the points, `p_body` = p_scanner, `apart_s` = 0. `same_ring_deg`: returns
/// whose elevations differ by less are of one ring.
std::vector<LaserSample> laser_samples(const std::vector<Eigen::Vector3f>& p_scanner,
                                       const std::vector<float>& intensity, double same_ring_deg = 0.12);

/// The share of weaker ones that each has: scanners scale intensities as they like.
std::vector<float> ranks(const std::vector<float>& intensity);

}  // namespace hueline::calibration
