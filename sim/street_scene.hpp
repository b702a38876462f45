#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/mesh.hpp"
#include "sim/vehicle.hpp"

namespace hueline::sim {

/// Linear reflectance, 0 .. 1.
struct Albedo {
  float r = 0, g = 0, b = 0;
};

/// How one building's front looks.
struct FacadeStyle {
  Albedo wall, trim, sign, door;
  double width_m = 12, height_m = 10;
  double bay_m = 2.4, storey_m = 3.1;      ///< raster of the windows above the ground floor
  double window_width_m = 1.2, window_height_m = 1.7;
  bool is_brick = false, has_shop = false;
  std::uint32_t seed = 0;
};

/// The whole static street and the shape of a car, before any ray is cast. Built from scenario and seed alone.
struct StreetScene {
  Mesh still;                         ///< local level of the scene
  Mesh car;                           ///< one moving car: x right, y forward, z up from the road
  std::vector<FacadeStyle> facades;   ///< style of Material::Facade and SideWall
  std::vector<Albedo> paints;         ///< style of CarPaint, CarGlass, CarEnd, SignFace, Awning
  std::vector<std::string> surfaces;  ///< names; TrueReturn::surface indexes them; [0] is "nothing", [1] "own vehicle"
  std::vector<std::uint16_t> moving_car_surfaces;
  double road_half_width_m = 3.5, zebra_at_m = 0;
};

StreetScene build_street(const Scenario& scenario, const CentreLine& line, double drive_length_m);

/// Parts of build_street (street_furniture.cpp). Each returns the index of the surface it added.
std::uint16_t add_surface(StreetScene& scene, const std::string& name);
void add_car(Mesh& mesh, const Pose& T_enu_car, std::uint16_t surface, std::uint32_t paint);
void add_furniture(StreetScene& scene, const Scenario& scenario, const CentreLine& line, double drive_length_m);

}  // namespace hueline::sim
