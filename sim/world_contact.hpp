#pragma once

#include "sim/world.hpp"

namespace hueline::sim {

/// What the shading needs to know of a hit in addition to Seen.
struct World::Contact {
  const Mesh::Face* face = nullptr;  ///< null: sky or own vehicle
  float u = 0, v = 0;                ///< texture coordinates
  Vec3 grad_u, grad_v;
  bool in_sun = false;
  int own_part = -1;

  /// Describes a hit of a face, here and in `seen`. `hu` and `hv` are Embree's coordinates in the quad.
  void set_hit(const Mesh& mesh, unsigned prim, float hu, float hv, double distance, Seen& seen);
};

}  // namespace hueline::sim
