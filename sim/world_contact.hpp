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
};

}  // namespace hueline::sim
