#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "calibration/mount/alignment_picture.hpp"
#include "calibration/mount/fast_lens.hpp"

namespace hueline::calibration {

/// How well image and laser lie over each other, at one width of blur. Pictures are made once; score() is pure and
/// cheap.
class AlignmentScore {
 public:
  /// Takes `most_samples` at most of those near the shots' moments, and as many outlines. The arguments must outlive
  /// it.
  AlignmentScore(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                 const std::vector<std::size_t>& which, const Transform<Body, CameraHead>& start,
                 const AlignmentConfig& config, float blur_px, std::size_t most_samples);

  /// Larger is better. Outlines: mean edge under the outlines against the mean edge of the pictures. Intensity: mutual
  /// information, nat.
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
