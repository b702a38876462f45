#pragma once

#include <cstdint>

#include "core/keys.hpp"

/// Settings of the scenes other than the street. scenario_keys.cpp lists their keys.
namespace hueline::sim {

/// What the vehicle drives through. All scenes but Targets lie along the same centre line and take road, kerb, trees
/// and sun from StreetConfig as far as they have them.
enum class SceneKind : std::uint8_t {
  Street,  ///< houses on both sides, trees, parked and oncoming cars
  Square,  ///< an open paved square with flower beds, columns and lamp posts; the fronts are far away
  Canyon,  ///< the street between houses of five to nine storeys, open at its ends
  Alley,   ///< walls 2 to 5 m from the vehicle's path
  /// Two lanes each way: oncoming and overtaking cars and vans, people on the pavements and on the crossing.
  Traffic,
  Tunnel,   ///< a road that runs through a lit tunnel
  Targets,  ///< an open pit with sphere targets on tripods and things that look like them
};

/// The scene `alley`.
struct AlleyConfig {
  double near_m = 2.0, far_m = 5.0;  ///< least and largest distance of a wall from the vehicle's path

  void visit(Keys& keys);
};

/// The scene `traffic`.
struct TrafficConfig {
  double spacing_m = 34.0;  ///< distance between oncoming vehicles of a lane; each lane has street.moving_cars of them
  int overtaking_cars = 3;
  double overtaking_speed = 13.0;  ///< m/s
  int pedestrians = 14;            ///< number on the pavements; four more are on the crossing

  void visit(Keys& keys);
};

/// The scene `tunnel`.
struct TunnelConfig {
  double from_m = 22.0, length_m = 46.0;  ///< along the centre line
  double height_m = 5.2;
  double lamp_spacing_m = 6.0;

  void visit(Keys& keys);
};

/// The panes of glass of all scenes.
struct GlassConfig {
  double refractive_index = 1.52;
  double transmittance = 0.92;  ///< share of the light that is left by what a pane absorbs on one passage

  void visit(Keys& keys);
};

/// What a road user is.
enum class RoadUserKind : std::uint8_t { Car, Van, Lorry, Person };

/// A road user that keeps its speed and its distance from the centre line through the whole drive.
struct RoadUserConfig {
  RoadUserKind kind = RoadUserKind::Car;
  double at_m = 0;       ///< place of its middle along the centre line at the sensors' start
  double lateral_m = 0;  ///< distance to the right of the centre line
  double speed = 8;      ///< m/s; negative: against the direction of the drive
  int paint = 0;         ///< index into usual_paints()

  void visit(Keys& keys);
};

/// The scene `targets`.
struct TargetsConfig {
  int large = 6, small = 4;  ///< number of spheres of 145 mm and of 72.5 mm radius
  int decoys = 8;            ///< number of balls of other sizes, domes, barrels and boulders

  void visit(Keys& keys);
};

}  // namespace hueline::sim
