#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/mesh.hpp"
#include "sim/radiance.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {

/// Linear reflectance, 0 .. 1.
struct Albedo {
  float r = 0, g = 0, b = 0;
};

/// The look of one building's front.
struct FacadeStyle {
  Albedo wall, trim, sign, door;
  double width_m = 12, height_m = 10;
  double bay_m = 2.4, storey_m = 3.1;  ///< grid of the windows above the ground floor
  double window_width_m = 1.2, window_height_m = 1.7;
  bool is_brick = false, has_shop = false;
  bool is_glazed = false;  ///< panes with a room behind them in the ground floor, instead of painted windows
  std::uint32_t seed = 0;
};

/// A rigid shape that moves by itself. Its frame: x right, y forward, z up from the ground.
struct MovingShape {
  Mesh mesh;
  double centre_up_m = 0.7, reach_m = 2.7;  ///< height of the centre and radius of a sphere that contains the shape
  double front_m = 0;                       ///< y of its headlights; 0: it has none
};

/// One moving thing. It moves along the centre line or across it at constant speed, and waits underground while its s
/// is not within from_s .. to_s.
struct Mover {
  std::size_t shape = 0;  ///< index into Scene::shapes
  std::uint16_t surface = 0;
  double s_m = 0, lateral_m = 0;  ///< place at the sensors' start
  double speed = 0;               ///< m/s along its own forward axis
  double along = -1;              ///< 1: with the drive, -1: against it, 0: across
  double across = 0;              ///< 1: to the right, -1: to the left
  double from_s = -62, to_s = 0;  ///< m along the centre line
};

/// A straight roofed box without sun. Daylight enters at its ends; lamps give the rest of the light.
struct Enclosure {
  bool is_there = false;
  Vec3 from, along, right;  ///< middle of the floor at the near end, and two unit vectors
  double length_m = 0, half_width_m = 0, height_m = 0;
};

/// A lamp. Its light spreads downwards from a point and casts no shadows.
struct LightSource {
  Vec3 place;
  float power = 1;  ///< light on a white surface 1 m below the lamp
};

/// A lamp that shines at night and throws shadows. It stands in the street, or moves with the vehicle that carries it.
struct NightLamp {
  static constexpr int kStill = -2, kOwnVehicle = -1;
  Vec3 place;            ///< in the scene's local level, or in the frame of its carrier
  int carrier = kStill;  ///< kStill, kOwnVehicle or an index into Scene::movers
  /// Whether it shines ahead (y of its carrier), dipped. Otherwise it shines downwards.
  bool is_headlight = false;
  Radiance power;  ///< light on a white surface that faces it at 1 m
};

/// A straight piece of something round that may be thinner than a pixel: a wire, a rope, a stake. The world looks for
/// it within a sheath, and knows which share of a pixel it fills.
struct Wire {
  Vec3 from, to;
  double radius_m = 0.006;
};
constexpr double kSheathRadius = 0.12;  ///< m; pixels up to twice as wide see a wire with its true share

/// A sphere whose true place is known.
struct SphereTarget {
  std::uint16_t surface = 0;
  Vec3 centre;  ///< in the scene's local level
  double radius_m = 0;
};

/// The whole world before any ray is cast. It is built from scenario and seed alone.
struct Scene {
  Mesh still;  ///< what does not move, in the scene's local level
  /// Panes, fences and the sheaths of wires: what light passes, through it or between its parts. It does not move and
  /// throws no shadow.
  Mesh sheer;
  std::vector<Wire> wires;  ///< indexed by QuadTag::style of Material::Wire
  std::vector<MovingShape> shapes;
  std::vector<Mover> movers;
  std::vector<FacadeStyle> facades;  ///< indexed by QuadTag::style of Material::Facade and SideWall
  std::vector<Albedo> paints;  ///< indexed by QuadTag::style of CarPaint, CarGlass, CarEnd, SignFace, Awning, Cloth
  std::vector<std::string> surfaces{"nothing", "own vehicle"};  ///< names, indexed by TrueReturn::surface
  std::vector<SphereTarget> targets;
  std::vector<LightSource> lamps;
  std::vector<NightLamp> night_lamps;
  Enclosure enclosure;
  double road_half_width_m = 3.5, zebra_at_m = 0;
};

/// Builds the scene that the scenario names. `line` covers 70 m before the start to 90 m after the halt at
/// `drive_length_m`.
Scene build_scene(const Scenario& scenario, const CentreLine& line, double drive_length_m);

/// Adds a name to Scene::surfaces and returns its index.
std::uint16_t add_surface(Scene& scene, const std::string& name);

}  // namespace hueline::sim
