#pragma once

#include <vector>

#include "calibration/mount/alignment.hpp"

namespace hueline::calibration {

/// The result of adjust_head().
struct HeadAdjustment {
  Transform<Body, CameraHead> T_body_head;  ///< the start with a new rotation
  double time_offset_s = 0;
  /// Covariance of the rotation about the head's axes (rad) and of the time offset (s), from the differences between
  /// stretches of the drive.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  std::size_t patches = 0, samples = 0;
  int steps = 0;
};

/// Refines the rotation of a head from a start that is at most a degree off. Gauss-Newton steps on IntensityRelation go
/// from blurred images to sharp ones. If `time_is_free`, the time offset is estimated with the rotation.
/// Errors: Unavailable (too few patches in which intensity follows the grey level, a rotation that they do not
/// determine, steps that do not converge or lead too far).
Result<HeadAdjustment> adjust_head(const std::vector<AlignmentLens>& lenses, const std::vector<AlignmentShot>& shots,
                                   const Transform<Body, CameraHead>& start, double time_offset_s, bool time_is_free,
                                   const AlignmentConfig& config);

}  // namespace hueline::calibration
