#pragma once

#include "core/stamped.hpp"
#include "fusion/head_projector.hpp"
#include "fusion/rig_geometry.hpp"
#include "fusion/trajectory.hpp"

/// How the head moves while its lenses are exposed. Pure functions.
namespace hueline::fusion {

/// Poses this far before and after an exposure tell how the head moves.
constexpr nanoseconds kMotionAround{5'000'000};

/// Returns how the head moves at a time, from the poses around it, without HeadMotion::lateness. A head whose poses
/// around are missing is taken to stand.
HeadMotion motion_at(const Trajectory& trajectory, GpsTime time, const Transform<Body, CameraHead>& T_body_head);

/// Returns a motion as another frame of the head sees it. `T_shot_head` leads from that frame to the motion's own.
HeadMotion motion_from(const HeadMotion& motion, const Transform<CameraHead, CameraHead>& T_shot_head);

/// Returns how much later than `moment` the middle of a lens's exposure is, s: HeadMotion::lateness. What differs by
/// less than clocks and strobes do is 0, so that lenses that are exposed at once need no correction.
float lateness_at(const Exposure& exposure, const LensMount& lens, GpsTime moment);

}  // namespace hueline::fusion
