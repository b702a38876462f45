#pragma once

#include <embree3/rtcore.h>

#include <vector>

#include "sim/world.hpp"

namespace hueline::sim {

constexpr double kShadowBias = 2e-3;  ///< distance from a surface at which a ray to a light begins, m

/// Returns whether a ray comes near a shape; the direction has unit length.
bool passes(const MovingShape& shape, const Pose& T_enu_mover, Vec3 origin, Vec3 direction);
/// Sets origin, direction and range of one of Embree's rays.
void set(RTCRay& ray, Vec3 origin, Vec3 direction, float near_m, float far_m);

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
