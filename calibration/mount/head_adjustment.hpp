#pragma once

#include "calibration/mount/alignment.hpp"

namespace hueline::calibration {

struct HeadAdjustment {
  Transform<Body, CameraHead> T_body_head;  ///< the start, turned
  double time_offset_s = 0;
  /// Of turn about the head's axes (rad) and time (s), from how much stretches of the drive pull against each other.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  std::size_t patches = 0, samples = 0;
  int steps = 0;
};

/// The last tenths of a degree, from at most a degree off: Gauss and Newton's steps on IntensityRelation, from blurred
/// images to sharp ones. `time_is_free`: the time offset is looked for with the turn. Errors: Unavailable (too few
/// patches in which intensity follows grey, a turn that they do not fix, steps that do not end or lead too far).
Result<HeadAdjustment> adjust_head(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                                   const Transform<Body, CameraHead>& start, double time_offset_s, bool time_is_free,
                                   const AlignmentConfig& config);

}  // namespace hueline::calibration
