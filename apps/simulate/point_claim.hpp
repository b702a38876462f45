#pragma once

#include "core/coloured_point.hpp"
#include "core/frames.hpp"
#include "sim/judge.hpp"

namespace hueline::apps {

/// Converts a vector to the simulator's type.
inline sim::Vec3 vec3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Returns a point in the form that the simulator's judge takes. `T_ecef_enu` belongs to the cloud's origin. `exposure`
/// is the number of the true exposure that corresponds to the point's exposure. `is_panorama` says that the point's
/// pixel is in the panorama.
inline sim::Claim claim_of(const ColouredPoint& point, const Transform<Ecef, Enu>& T_ecef_enu, std::uint32_t exposure,
                           bool is_panorama) {
  sim::Claim claim;
  claim.fired_gps_ns = count_ns(point.time);
  claim.channel = point.channel;
  claim.exposure = exposure;
  claim.lens = point.lens;
  claim.is_panorama_pixel = is_panorama;
  claim.u = point.u;
  claim.v = point.v;
  claim.red = point.red;
  claim.green = point.green;
  claim.blue = point.blue;
  claim.place_ecef = vec3((T_ecef_enu * Point<Enu>{{point.east, point.north, point.up}}).xyz);
  return claim;
}

}  // namespace hueline::apps
