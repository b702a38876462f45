#pragma once

#include <span>
#include <string>

#include "sim/world.hpp"

namespace hueline::sim {

/// A scenario with its world, to be asked by single rays.
struct Made {
  explicit Made(const Scenario& s) : scenario(s), motion(s), world(s, motion) {}
  GpsNs at(double seconds) const { return scenario.sensors_begin_gps_ns() + static_cast<GpsNs>(seconds * 1e9); }
  Seen look(double seconds, Vec3 from, Vec3 direction, double far_m = 300, float cone = 0.001f) const {
    const Moment moment = world.moment(at(seconds));
    const World::Ray ray{from, normalised(direction), 0.01, far_m};
    Seen seen;
    world.look(moment, std::span(&ray, 1), cone, std::span(&seen, 1));
    return seen;
  }
  const std::string& name_of(const Seen& seen) const { return world.surfaces()[seen.surface]; }

  Scenario scenario;
  Motion motion;
  World world;
};

}  // namespace hueline::sim
