#include "fusion/head_motion.hpp"

#include <chrono>

#include <Eigen/Geometry>

#include "core/portable_math.hpp"
#include "fusion/lens_exposure.hpp"

namespace hueline::fusion {
namespace {

constexpr nanoseconds kExposedAtOnce{
    10'000};  // lenses exposed less than this apart are exposed at once: 0.3 mm at 30 m/s

std::array<float, 3> as_array(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

Eigen::Vector3d as_vector(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }

}  // namespace

HeadMotion motion_at(const Trajectory& trajectory, GpsTime time, const Transform<Body, CameraHead>& T_body_head) {
  HeadMotion motion;
  const auto before = trajectory.pose_at(time - kMotionAround).pose, at = trajectory.pose_at(time).pose,
             after = trajectory.pose_at(time + kMotionAround).pose;
  if (!before || !at || !after) return motion;
  const double duration = to_seconds(2 * kMotionAround);
  const Transform<Enu, CameraHead> from = before->T_enu_body * T_body_head, to = after->T_enu_body * T_body_head;
  const Eigen::Quaterniond R_head_enu = (at->T_enu_body * T_body_head).inverse().rotation;
  motion.velocity = as_array(R_head_enu * (to.translation - from.translation) / duration);
  // What turns a standing point from the head's axes before to those after.
  motion.rate = as_array(portable::rotation_vector(to.rotation.inverse() * from.rotation) / duration);
  return motion;
}

HeadMotion motion_from(const HeadMotion& motion, const Transform<CameraHead, CameraHead>& T_shot_head) {
  // A standing point q of the motion's frame has the speed rate x q - velocity, and q = R p + t.
  const Eigen::Quaterniond R = T_shot_head.rotation.inverse();
  const Eigen::Vector3d rate = R * as_vector(motion.rate);
  HeadMotion out = motion;
  out.rate = as_array(rate);
  out.velocity = as_array(R * as_vector(motion.velocity) - rate.cross(R * T_shot_head.translation));
  return out;
}

float lateness_at(const Exposure& exposure, const LensMount& lens, GpsTime moment) {
  const nanoseconds late = exposure.exposure_mid + lateness_of(exposure, lens) - moment;
  return std::chrono::abs(late) < kExposedAtOnce ? 0.0f : static_cast<float>(to_seconds(late));
}

}  // namespace hueline::fusion
