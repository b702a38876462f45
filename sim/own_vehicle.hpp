#pragma once

#include <optional>

#include "sim/vec3.hpp"

namespace hueline::sim {

struct VehicleContact {
  double distance_m = 0;
  Vec3 normal_body;
  int part = 0;
};

/// First of the mapping vehicle's own parts (a van: boxes in Body) on a ray. A part that contains the ray's origin is
/// not seen: a lens sits inside its head, a scanner's beam starts inside its housing.
std::optional<VehicleContact> own_vehicle_on_ray(Vec3 origin_body, Vec3 direction_body);

}  // namespace hueline::sim
