#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim/radiance.hpp"
#include "sim/scene.hpp"
#include "sim/surroundings.hpp"
#include "sim/texture.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {

/// What a ray hit. Places are in the scene's local level, m.
struct Seen {
  bool is_hit = false;
  double distance_m = 0;
  std::uint16_t surface = 0;  ///< index into World::surfaces(); 0: nothing, 1: the own vehicle
  Material material = Material::Asphalt;
  /// Number of the face in its mesh; two neighbouring rays with different faces lie on both sides of an outline or
  /// edge.
  std::uint32_t face = 0;
  Vec3 normal;
  float reflectance = 0;  ///< grey reflectance of the surface, 0 .. 1
  Albedo albedo;          ///< the surface's own colour, unshaded
  /// Light of this surface alone towards the ray's origin, in sun or shadow, or of the sky: without what panes mirror
  /// and absorb and without what covers a part of the cone. This is the true colour of a laser return.
  Radiance own;
  /// All light that arrives at the ray's origin from the ray's cone. This is what a camera sees.
  Radiance colour;
  /// Share of the surface's light that the panes on the way let pass. Below kHiding a lens does not see the surface.
  float transmitted = 1;

  static constexpr float kHiding = 0.5f;
  bool is_hidden_by_glass() const { return transmitted < kHiding; }
};

/// The poses of everything that moves, at one time.
struct Moment {
  GpsNs gps_ns = 0;
  Pose T_enu_body, T_body_enu;
  std::vector<Pose> T_enu_mover, T_mover_enu;  ///< indexed like Scene::movers
};

/// The scene, to be asked by rays. Immutable after construction; every function is thread-safe and deterministic.
class World {
 public:
  World(const Scenario& scenario, const Motion& motion);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Returns the poses of the vehicle and of everything that moves at time `t`.
  Moment moment(GpsNs t) const;
  /// Returns the same for a firing within a packet: from `base` on, the movers go on in straight lines, and the vehicle
  /// has the given pose.
  Moment moment(const Moment& base, GpsNs t, const Pose& T_enu_body) const;

  static constexpr std::size_t kBatch = 8;
  /// A ray, and the range of distances in which it can hit something.
  struct Ray {
    Vec3 origin, direction;  ///< in the scene's local level; the direction has unit length
    double near_m = 0.01, far_m = 1000;
  };
  /// Finds what up to kBatch rays hit. `cone` is the opening angle of a ray in rad; textures are averaged over its
  /// footprint, and so is the share of the footprint that wires and fences cover. What a ray hits is decided by its
  /// middle: it hits the wire or the bar on which it falls, else what is behind. It passes panes.
  void look(const Moment& at, std::span<const Ray> rays, float cone, std::span<Seen> seen) const;

  const std::vector<std::string>& surfaces() const { return scene_.surfaces; }
  const std::vector<SphereTarget>& targets() const { return scene_.targets; }
  /// Returns true if the surface moves by itself (other cars, people); false for the rest of the scene and for the
  /// own vehicle.
  bool is_moving(std::uint16_t surface) const;

 private:
  struct Embree;
  struct Contact;
  void trace(const Moment& at, std::span<const Ray> rays, std::span<Seen> seen, std::span<Contact> contacts) const;
  void find_shadows(const Moment& at, std::span<const Ray> rays, std::span<const Seen> seen,
                    std::span<Contact> contacts) const;
  /// look() without panes, fences and wires.
  void look_at_solids(const Moment& at, std::span<const Ray> rays, float cone, std::span<Seen> seen) const;
  /// Adds what is sheer to what a ray sees, in `seen`.
  void look_through(const Moment& at, const Ray& ray, float cone, Seen& seen) const;
  /// Adds the water on the ground to what a ray sees.
  void add_water(const Moment& at, const Ray& ray, float cone, Seen& seen) const;
  /// Returns what a ray sees in the mirror of a surface at `distance_m`: solid things and the sky.
  Seen mirrored(const Moment& at, const Ray& ray, double distance_m, Vec3 normal, float cone) const;
  Radiance sky(Vec3 direction, float cone) const;
  /// Returns the share of the sky's light that reaches a place; 1 in the open.
  float daylight(Vec3 place) const;
  /// Returns the light of the lamps on a white surface.
  float lamplight(Vec3 place, Vec3 normal) const;
  /// Returns where on its texture a ray meets a surface, and the size of its footprint there.
  static TextureSample sample(const Ray& ray, const Seen& seen, const Contact& contact, float cone);
  /// Adds the light of lamps to that of the day, on a surface and from lamps that are seen themselves.
  Radiance with_lamps(const Moment& at, const Ray& ray, const Seen& seen, const Contact& contact, float cone,
                      Radiance by_day) const;
  /// Returns whether nothing is between a place and a lamp. Neither the vehicle that carries the lamp nor panes, fences
  /// and wires count.
  bool is_lit_by(const Moment& at, const NightLamp& lamp, Vec3 place, Vec3 to, double distance_m) const;
  /// Returns the light of a surface by day, or of the sky, and fills in what `seen` says of the surface.
  Radiance shade(const Ray& ray, Seen& seen, const Contact& contact, float cone) const;

  const Motion& motion_;
  StreetConfig config_;
  GlassConfig glass_;
  GpsNs begin_;
  Scene scene_;
  Vec3 to_sun_;
  std::shared_ptr<const Surroundings> surroundings_;  ///< null: the painted sky
  std::vector<std::uint8_t> is_moving_;               ///< indexed by surface
  std::unique_ptr<Embree> embree_;
};

}  // namespace hueline::sim
