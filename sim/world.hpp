#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "sim/radiance.hpp"
#include "sim/scene.hpp"
#include "sim/surroundings.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {

/// What a ray met. Places in the scene's local level, m.
struct Seen {
  bool is_hit = false;
  double distance_m = 0;
  std::uint16_t surface = 0;  ///< index into World::surfaces(); 0: nothing, 1: own vehicle
  Material material = Material::Asphalt;
  std::uint32_t face = 0;  ///< of its mesh: two rays with unequal faces straddle an outline or an edge
  Vec3 normal;
  float reflectance = 0;  ///< of the surface, grey, 0 .. 1
  Albedo albedo;          ///< the surface's own colour, unshaded
  Radiance colour;        ///< light towards the ray's origin: surface in sun or shadow, or sky
};

/// Everything that moves, at one instant.
struct Moment {
  GpsNs gps_ns = 0;
  Pose T_enu_body, T_body_enu;
  std::vector<Pose> T_enu_mover, T_mover_enu;  ///< as in Scene::movers
};

/// The scene under rays. Immutable after construction; every function is thread-safe and deterministic.
class World {
 public:
  World(const Scenario& scenario, const Motion& motion);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Poses of the vehicle and of all that moves at an instant.
  Moment moment(GpsNs t) const;
  /// The same for several firings within a packet: what moves goes on in a straight line from `base`.
  Moment moment(const Moment& base, GpsNs t, const Pose& T_enu_body) const;

  static constexpr std::size_t kBatch = 8;
  struct Ray {
    Vec3 origin, direction;  ///< scene's local level; unit length
    double near_m = 0.01, far_m = 1000;
  };
  /// Up to kBatch rays at a time. `cone`: opening angle of a ray, rad: textures are averaged over its footprint.
  void look(const Moment& at, std::span<const Ray> rays, float cone, std::span<Seen> seen) const;

  const std::vector<std::string>& surfaces() const { return scene_.surfaces; }
  const std::vector<SphereTarget>& targets() const { return scene_.targets; }
  /// True for what moves by itself (other cars, people); false for the scene and for the own vehicle.
  bool is_moving(std::uint16_t surface) const;

 private:
  struct Embree;
  struct Contact;
  void trace(const Moment& at, std::span<const Ray> rays, std::span<Seen> seen, std::span<Contact> contacts) const;
  void find_shadows(const Moment& at, std::span<const Ray> rays, std::span<const Seen> seen,
                    std::span<Contact> contacts) const;
  Radiance sky(Vec3 direction, float cone) const;
  /// Share of the sky's light that reaches a place: 1 in the open.
  float daylight(Vec3 place) const;
  /// Light of the lamps on a white surface.
  float lamplight(Vec3 place, Vec3 normal) const;
  Radiance shade(const Ray& ray, Seen& seen, const Contact& contact, float cone) const;

  const Motion& motion_;
  StreetConfig config_;
  GpsNs begin_;
  Scene scene_;
  Vec3 to_sun_;
  std::shared_ptr<const Surroundings> surroundings_;  ///< null: the painted sky
  std::vector<std::uint8_t> is_moving_;               ///< by surface
  std::unique_ptr<Embree> embree_;
};

}  // namespace hueline::sim
