#include <algorithm>
#include <cmath>

#include "sim/scene_parts.hpp"

/// A road that runs through a hill.
namespace hueline::sim {
namespace {

constexpr double kWalk = 0.9, kWalkHeight = 0.25;  // raised walks along the walls, m
constexpr double kHill = 11.0, kHillHalf = 46.0;   // height above the road and half width, m

void add_portal(Scene& scene, const CentreLine& line, double s, double half, double height, std::uint16_t front,
                std::uint16_t slope, double outwards) {
  const auto at = [&](double along, double lateral, double up) {
    return line.place(s + outwards * along, lateral, up);
  };
  const QuadTag concrete{Material::Lining, front, 1}, grass{Material::Grass, slope, 0};
  Mesh& mesh = scene.still;
  // The front wall around the opening, and the face of the hill beside and above it.
  mesh.rectangle({at(0, -half - 5, 0), at(0, -half, 0), at(0, -half, height), at(0, -half - 5, height)}, concrete);
  mesh.rectangle({at(0, half, 0), at(0, half + 5, 0), at(0, half + 5, height), at(0, half, height)}, concrete);
  mesh.rectangle({at(0, -half - 5, height), at(0, half + 5, height), at(0, half + 5, height + 1.6),
                  at(0, -half - 5, height + 1.6)},
                 concrete);
  mesh.rectangle({at(6, -kHillHalf, 0), at(0, -half - 5, 0), at(0, -half - 5, height + 1.6), at(-4, -kHillHalf, kHill)},
                 grass);
  mesh.rectangle({at(0, half + 5, 0), at(6, kHillHalf, 0), at(-4, kHillHalf, kHill), at(0, half + 5, height + 1.6)},
                 grass);
  mesh.rectangle({at(0, -half - 5, height + 1.6), at(0, half + 5, height + 1.6), at(-4, kHillHalf, kHill),
                  at(-4, -kHillHalf, kHill)},
                 grass);
}

/// The tunnel along the road, m.
struct Tube {
  double from, to;    ///< along the road
  double road, half;  ///< half widths of the road, and from wall to wall
  double height;
};

/// The meadow on both sides, and the hill with its portals.
void add_hill(Scene& scene, const CentreLine& line, const Tube& tube, double begin, double end, double length) {
  const std::uint16_t verge = add_surface(scene, "verge"), hill = add_surface(scene, "hill"),
                      front = add_surface(scene, "portal");
  for (const double side : {-1.0, 1.0})
    for (const auto& [a, b] : {std::pair{begin, tube.from}, std::pair{tube.to, end}})
      add_ribbon(scene.still, line, a, b, side > 0 ? tube.road : -kHillHalf, -0.01, side > 0 ? kHillHalf : -tube.road,
                 -0.01, {Material::Grass, verge, 0});
  add_plain(scene, line, length, Material::Grass);
  add_portal(scene, line, tube.from, tube.half, tube.height, front, hill, -1);
  add_portal(scene, line, tube.to, tube.half, tube.height, front, hill, 1);
  add_ribbon(scene.still, line, tube.from + 4, tube.to - 4, -kHillHalf, kHill, kHillHalf, kHill,
             {Material::Grass, hill, 0});
}

/// Niches with a door and a lit sign above it, in the wall of one side (-1 left, 1 right).
void add_niches(Scene& scene, const CentreLine& line, const Tube& tube, double side) {
  std::uint32_t number = 0;
  for (double s = tube.from + 9; s < tube.to - 4; s += 17, ++number) {
    const Pose T{R_enu_body(0, 0, line.heading(s)), line.place(s, side * tube.half, 0)};
    const std::uint16_t door = add_surface(scene, "door " + std::to_string(number) + (side > 0 ? " right" : " left"));
    scene.still.box(T, {side > 0 ? -0.06 : -0.02, -0.65, kWalkHeight}, {side > 0 ? 0.02 : 0.06, 0.65, 2.4},
                    {Material::CarPaint, door, 5});
    scene.still.box(T, {side > 0 ? -0.25 : -0.02, -0.45, 2.55}, {side > 0 ? 0.02 : 0.25, 0.45, 2.95},
                    {Material::CarPaint, door, number % 2 == 0 ? 4u : 0u});
  }
}

/// Walls, raised walks, pipes, niches and the ceiling.
void add_lining(Scene& scene, const CentreLine& line, const Tube& tube) {
  const auto [from, to, road, half, height] = tube;
  Mesh& mesh = scene.still;
  const std::uint16_t walk = add_surface(scene, "walk"), ceiling = add_surface(scene, "ceiling");
  for (const double side : {-1.0, 1.0}) {
    const std::uint16_t wall = add_surface(scene, side > 0 ? "lining right" : "lining left");
    add_ribbon(mesh, line, from, to, side * half, 0, side * half, height, {Material::Lining, wall, 0});
    add_ribbon(mesh, line, from, to, side * road, 0, side * road, kWalkHeight, {Material::Kerb, walk, 0});
    add_ribbon(mesh, line, from, to, side > 0 ? road : -half, kWalkHeight, side > 0 ? half : -road, kWalkHeight,
               {Material::Pavement, walk, 0});
    const std::uint16_t rail = add_surface(scene, side > 0 ? "pipe right" : "pipe left");
    mesh.rod(line.place(from, side * (half - 0.12), 3.4), line.place(to, side * (half - 0.12), 3.4), 0.08, 10,
             {Material::Steel, rail, 0});
    add_niches(scene, line, tube, side);
  }
  add_ribbon(mesh, line, from, to, -half, height, half, height, {Material::Lining, ceiling, 1});
}

/// Lamps below the ceiling, in two rows.
void add_ceiling_lamps(Scene& scene, const CentreLine& line, const Tube& tube, double spacing_m) {
  const std::uint16_t lamps = add_surface(scene, "lamps");
  for (double s = tube.from + 2; s < tube.to - 1; s += spacing_m)
    for (const double side : {-1.0, 1.0}) {
      const Vec3 place = line.place(s, side * 0.55 * tube.half, tube.height - 0.16);
      scene.still.box({R_enu_body(0, 0, line.heading(s)), place}, {-0.12, -0.6, 0}, {0.12, 0.6, 0.10},
                      {Material::LampGlass, lamps, 0});
      const Vec3 a = place + Vec3{0, 0, -0.001}, x = normalised(line.place(s, 1) - line.place(s, 0)),
                 y = normalised(line.place(s + 1, 0) - line.place(s, 0));
      scene.still.rectangle(
          {a - 0.12 * x - 0.6 * y, a - 0.12 * x + 0.6 * y, a + 0.12 * x + 0.6 * y, a + 0.12 * x - 0.6 * y},
          {Material::LampGlass, lamps, 0});
      scene.lamps.push_back({place, 0.9f});
    }
}

Enclosure enclosure_of(const CentreLine& line, const Tube& tube, double length_m) {
  Enclosure in;
  in.is_there = true;
  in.from = line.place(tube.from, 0);
  in.along = normalised(line.place(tube.to, 0) - in.from);
  in.right = cross(in.along, Vec3{0, 0, 1});
  in.length_m = length_m;
  in.half_width_m = tube.half + 0.05;
  in.height_m = tube.height + 0.05;
  return in;
}

}  // namespace

Scene build_tunnel(const Scenario& c, const CentreLine& line, double length) {
  Scene scene;
  const double from = c.tunnel.from_m, to = from + c.tunnel.length_m, road = c.street.road_width_m / 2;
  const Tube tube{from, to, road, road + kWalk, c.tunnel.height_m};
  const double begin = -kStreetBehind, end = std::max(length, to) + kStreetAhead;
  add_ribbon(scene.still, line, begin, end, -road, 0, road, 0, {Material::Asphalt, add_surface(scene, "road"), 0});
  add_hill(scene, line, tube, begin, end, length);
  add_lining(scene, line, tube);
  add_ceiling_lamps(scene, line, tube, c.tunnel.lamp_spacing_m);
  scene.enclosure = enclosure_of(line, tube, c.tunnel.length_m);

  Draw draw{c.seed, kStreamScene + 41};
  std::uint32_t number = 0;
  for (double s = begin + 6; s < end; s += c.street.tree_spacing_m)
    for (const double side : {-1.0, 1.0}) {
      if (s > from - 5 && s < to + 5) continue;
      const double beside = draw(0, 3), along = draw(-1, 1);
      add_tree(scene, line.place(s + along, side * (road + 4 + beside)), c.street.leaves_per_tree, draw, number);
      add_lamp(scene, c.street, line.place(s + 6, side * (road + 0.8)),
               normalised(line.place(s + 6, 0) - line.place(s + 6, side)), number++);
    }
  return scene;
}

}  // namespace hueline::sim
