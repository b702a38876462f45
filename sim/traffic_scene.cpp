#include <cmath>

#include "sim/scene_parts.hpp"

/// A main road with other vehicles and people.
namespace hueline::sim {
namespace {

constexpr std::array<std::uint32_t, 4> kCarPaints{4, 0, 1, 2};
constexpr std::size_t kVan = 4, kFirstPerson = 5;
constexpr std::uint32_t kPeople = 4;

void add_shapes(Scene& scene, const StreetConfig& street) {
  for (const std::uint32_t paint : kCarPaints) {
    scene.shapes.emplace_back();
    scene.shapes.back().front_m = kCarFront;
    add_car(scene.shapes.back().mesh, {}, 0, car_paint(street, paint));
  }
  scene.shapes.push_back({{}, 1.2, 3.4, kVanFront});
  add_van(scene.shapes.back().mesh, {}, 0, car_paint(street, 2));
  for (std::uint32_t i = 0; i < kPeople; ++i) {
    scene.shapes.push_back({{}, 0.9, 1.1});
    add_person(scene.shapes.back().mesh, {}, 0, 2 * i);
  }
}

void add_vehicles(Scene& scene, const Scenario& c, double length) {
  const double width = c.street.road_width_m;
  Draw draw{c.seed, kStreamScene + 33};
  for (int i = 0; i < c.street.moving_cars; ++i)
    for (int lane = 0; lane < 2; ++lane) {
      Mover m;
      m.shape = (i + 2 * lane) % 5 == 2
                    ? kVan
                    : (static_cast<std::size_t>(i) + 2 * static_cast<std::size_t>(lane)) % kCarPaints.size();
      m.surface = add_surface(scene, "moving oncoming " + std::to_string(2 * i + lane));
      m.speed = c.street.moving_car_speed * (lane == 0 ? 1.0 : 0.8);
      m.s_m = 26 + 13 * lane + c.traffic.spacing_m * i + draw(-3, 3);
      m.lateral_m = lane == 0 ? -width / 8 : -3 * width / 8;
      m.to_s = length + 80;
      scene.movers.push_back(m);
    }
  for (int i = 0; i < c.traffic.overtaking_cars; ++i) {
    Mover m;
    m.shape = i % 3 == 1 ? kVan : static_cast<std::size_t>(i + 1) % kCarPaints.size();
    m.surface = add_surface(scene, "moving overtaking " + std::to_string(i));
    m.speed = c.traffic.overtaking_speed;
    m.along = 1;
    m.s_m = -16 - 17.0 * i;
    m.lateral_m = width / 8;
    m.to_s = length + kStreetAhead - 6;
    scene.movers.push_back(m);
  }
}

void add_people(Scene& scene, const Scenario& c, double length) {
  Draw draw{c.seed, kStreamScene + 34};
  const double half = c.street.road_width_m / 2, inner = half + 1.7, outer = half + c.street.pavement_width_m;
  for (int i = 0; i < c.traffic.pedestrians; ++i) {
    Mover m;
    m.shape = kFirstPerson + static_cast<std::size_t>(i) % kPeople;
    m.surface = add_surface(scene, "moving pedestrian " + std::to_string(i));
    m.speed = draw(0.9, 1.7);
    m.along = i % 2 == 0 ? 1 : -1;
    m.lateral_m = (i % 4 < 2 ? 1 : -1) * draw(inner, std::max(inner + 0.1, outer));
    m.s_m = -8 + (length + 30) * (i + 0.5) / c.traffic.pedestrians;
    m.to_s = length + 80;
    scene.movers.push_back(m);
  }
  for (int i = 0; i < 4; ++i) {
    Mover m;
    m.shape = kFirstPerson + static_cast<std::size_t>(i) % kPeople;
    m.surface = add_surface(scene, "moving crossing " + std::to_string(i));
    m.speed = draw(1.0, 1.5);
    m.along = 0;
    m.across = i % 2 == 0 ? 1 : -1;
    m.s_m = c.street.zebra_at_m + 0.7 + 0.9 * i;
    m.lateral_m = -m.across * (half + draw(-4, 1));
    m.to_s = length + 80;
    scene.movers.push_back(m);
  }
}

}  // namespace

Scene build_traffic(const Scenario& c, const CentreLine& line, double length) {
  Scene scene = build_street(c, line, length);
  add_shapes(scene, c.street);
  add_vehicles(scene, c, length);
  add_people(scene, c, length);
  return scene;
}

}  // namespace hueline::sim
