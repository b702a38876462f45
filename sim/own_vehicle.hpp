#pragma once

#include <optional>

#include "sim/vec3.hpp"

namespace hueline::sim {

/// Where a ray meets the vehicle. `part` is the number of the box.
struct VehicleContact {
  double distance_m = 0;
  Vec3 normal_body;
  int part = 0;
};

/// Returns the first part of the own vehicle on a ray. The own vehicle carries the sensors; it is a van made of boxes
/// in Body. A part that contains the origin of the ray is left out, because a lens sits inside its head and a scanner's
/// beam starts inside its housing.
std::optional<VehicleContact> own_vehicle_on_ray(Vec3 origin_body, Vec3 direction_body);

}  // namespace hueline::sim
