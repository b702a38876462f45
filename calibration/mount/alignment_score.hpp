#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "calibration/mount/alignment_picture.hpp"

namespace hueline::calibration {

/// Turn of the head about its own axes, rad, and time offset of the images, s: what is looked for.
using HeadCorrection = Eigen::Vector4d;

/// T_body_head with a correction: p_head = exp(-turn) T_head_body p_body, so that the head is turned by `turn` about its own axes.
Transform<Body, CameraHead> corrected(const Transform<Body, CameraHead>& start, const HeadCorrection& correction);

/// How well image and laser lie over each other, at one width of blur. Pictures are made once; score() is pure and cheap.
class AlignmentScore {
 public:
  /// Takes of each shot every `stride`-th sample that is no outline. The arguments must outlive it.
  AlignmentScore(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots, const std::vector<std::size_t>& which,
                 const Transform<Body, CameraHead>& start, const AlignmentConfig& config, float blur_px, std::size_t stride);

  /// Larger is better. Outlines: mean edge under the outlines against the mean edge of the pictures. Intensity: mutual information, nat.
  double score(const HeadCorrection& correction) const;
  std::size_t outlines() const { return outlines_; }
  std::size_t samples() const { return samples_; }

 private:
  struct Prepared {
    const AlignmentShot* shot;
    AlignmentPicture edges, grey;
    double mean_edge = 0;
    std::vector<LaserSample> outlines, others;
  };
  const std::vector<AlignmentLens>& lenses_;
  Transform<Body, CameraHead> start_;
  AlignmentConfig config_;
  std::vector<Prepared> prepared_;
  std::size_t outlines_ = 0, samples_ = 0;
};

}  // namespace hueline::calibration
