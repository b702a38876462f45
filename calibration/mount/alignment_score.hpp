#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/mount/alignment.hpp"
#include "calibration/mount/alignment_picture.hpp"
#include "calibration/mount/fast_lens.hpp"

namespace hueline::calibration {

/// Measures how well images and laser samples fit together at one width of blur. The constructor prepares the pictures;
/// score() is pure and cheap.
class AlignmentScore {
 public:
  /// Uses at most `most_samples` of the samples that were fired near the exposures, and as many outlines. `lenses` and
  /// `shots` must outlive this object.
  AlignmentScore(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                 const std::vector<std::size_t>& which, const Transform<Body, CameraHead>& start,
                 const AlignmentConfig& config, float blur_px, std::size_t most_samples);

  /// Returns the score of a correction; larger is better. Outlines contribute the mean edge below the outlines relative
  /// to the mean edge of the pictures. Intensities contribute their mutual information with the grey levels, in nat.
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
