#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "calibration/lens/board.hpp"
#include "calibration/lens/lens_values.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"

/// Where a camera head sits, without targets: image and laser of many exposures are laid over each other until outlines of near things lie
/// on edges of the image (Levinson and Thrun, RSS 2013) and laser intensity tells most about grey levels (mutual information: Pandey et al.,
/// AAAI 2012). All lenses at once with the head's rigid geometry; the time offset of the images with it. Pure functions.
namespace hueline::calibration {

/// One laser return near an exposure, in Body at the middle of that exposure.
struct LaserSample {
  Eigen::Vector3f p_body = Eigen::Vector3f::Zero();
  float intensity = 0;  ///< 0 to 1
  float outline = 0;    ///< 0 to 1: how much it is the near side of a jump of range
};

/// One lens at one exposure.
struct AlignmentShot {
  std::size_t lens = 0;
  GreyImage image;
  std::vector<LaserSample> samples;
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
  int groups = 4;              ///< parts of the shots that are aligned on their own, for the standard deviations; below 2: none
  std::string validate() const;
};

struct Alignment {
  Transform<Body, CameraHead> T_body_head;  ///< the start, turned; its place is left as it was
  double time_offset_s = 0;                 ///< add it to the times of the images
  /// Standard deviations from the spread of groups of shots: turn about the head's axes (rad), time (s).
  Eigen::Vector4d sigma = Eigen::Vector4d::Zero();
  double score_start = 0, score = 0;        ///< of the finest step; larger is better
  std::size_t samples = 0, shots = 0;       ///< used
};

/// Errors: Invalid (settings), Unavailable (too few outlines, or no better place than the edge of the search).
Result<Alignment> align_head(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                             const Transform<Body, CameraHead>& start, const AlignmentConfig& config);

/// Outlines and equalised intensities of a cloud as one scanner sees it. `p_scanner` with the scanner in the origin; any order.
/// The result has the order of the points, `p_body` = p_scanner. `same_ring_deg`: returns whose elevations differ by less are of one ring.
std::vector<LaserSample> laser_samples(const std::vector<Eigen::Vector3f>& p_scanner, const std::vector<float>& intensity, double same_ring_deg = 0.12);

}  // namespace hueline::calibration
