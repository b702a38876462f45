#include "calibration/mount/fast_lens.hpp"

#include <algorithm>

namespace hueline::calibration {

Transform<Body, CameraHead> corrected(const Transform<Body, CameraHead>& start, const HeadCorrection& correction) {
  const Eigen::Vector3d turn = correction.head<3>();
  const double angle = turn.norm();
  if (!(angle > 0)) return start;
  return {(start.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle))).normalized(),
          start.translation};
}

FastLens fast_lens(const LensValues& values, double max_angle) {
  FastLens out;
  out.model = values.model;
  out.fx = static_cast<float>(values.focal_px.x());
  out.fy = static_cast<float>(values.focal_px.y());
  out.cx = static_cast<float>(values.principal_point_px.x());
  out.cy = static_cast<float>(values.principal_point_px.y());
  out.cosine = static_cast<float>(std::cos(std::min(max_angle, values.model == LensModel::Brown ? 1.4 : 3.0)));
  for (std::size_t i = 0; i < 5; ++i) out.k[i] = static_cast<float>(values.distortion[i]);
  out.R_lens_body.setIdentity();
  out.t_lens_body.setZero();
  return out;
}

FastLens fast_lens(const AlignmentLens& lens, const Transform<CameraHead, Body>& T_head_body, const AlignmentShot& shot,
                   double time_offset_s) {
  // The image was taken later than its time says. Until then the vehicle has moved on, and static objects lie farther
  // back in Body.
  const Eigen::Vector3d turn = shot.turn_rate_body * time_offset_s;
  const double angle = turn.norm();
  const Eigen::Quaterniond gone =
      angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(-angle, turn / angle)) : Eigen::Quaterniond::Identity();
  const Transform<Body, Body> later{gone, -(gone * (shot.velocity_body * time_offset_s))};
  const Transform<Lens, Body> T = lens.T_head_lens.inverse() * T_head_body * later;
  FastLens out = fast_lens(lens.values, lens.max_angle);
  out.R_lens_body = T.rotation.toRotationMatrix().cast<float>();
  out.t_lens_body = T.translation.cast<float>();
  return out;
}

}  // namespace hueline::calibration
