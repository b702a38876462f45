#pragma once

#include <embree3/rtcore.h>

#include <vector>

#include "sim/world.hpp"

namespace hueline::sim {

constexpr double kShadowBias = 2e-3;  ///< distance from a surface at which a ray to a light begins, m

/// Returns whether a ray comes near a shape; the direction has unit length.
inline bool passes(const MovingShape& shape, const Pose& T_enu_mover, Vec3 origin, Vec3 direction) {
  const Vec3 from = origin - T_enu_mover.p - Vec3{0, 0, shape.centre_up_m};
  const double ahead = dot(from, direction), off2 = dot(from, from), reach2 = shape.reach_m * shape.reach_m;
  return off2 < reach2 || (ahead < 0 && off2 - ahead * ahead < reach2);
}
/// Sets origin, direction and range of one of Embree's rays.
inline void set(RTCRay& ray, Vec3 o, Vec3 d, float near_m, float far_m) {
  ray.org_x = static_cast<float>(o.x);
  ray.org_y = static_cast<float>(o.y);
  ray.org_z = static_cast<float>(o.z);
  ray.dir_x = static_cast<float>(d.x);
  ray.dir_y = static_cast<float>(d.y);
  ray.dir_z = static_cast<float>(d.z);
  ray.tnear = near_m;
  ray.tfar = far_m;
  ray.time = 0;
  ray.mask = 0xFFFFFFFFu;
  ray.id = 0;
  ray.flags = 0;
}

/// A surface whose normal has a larger vertical part is level enough for water to stay on it.
constexpr double kLevel = 0.7;
/// Returns whether water darkens a ground of this material and stays on it.
bool soaks(Material material);

struct World::Embree {
  RTCDevice device = nullptr;
  RTCScene still = nullptr;
  RTCScene sheer = nullptr;  ///< null: nothing is sheer
  std::vector<RTCScene> shapes;
  ~Embree();
};

/// What the shading needs to know of a hit in addition to Seen.
struct World::Contact {
  const Mesh::Face* face = nullptr;  ///< null: sky or own vehicle
  float u = 0, v = 0;                ///< texture coordinates
  Vec3 grad_u, grad_v;
  bool in_sun = false;
  int own_part = -1;
  int mover = -1;  ///< index into Scene::movers; -1: the face does not move

  /// Describes a hit of a face, here and in `seen`. `hu` and `hv` are Embree's coordinates in the quad.
  void set_hit(const Mesh& mesh, unsigned prim, float hu, float hv, double distance, Seen& seen);
};

}  // namespace hueline::sim
