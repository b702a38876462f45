#include <algorithm>
#include <cmath>
#include <string>

#include "sim/scene_parts.hpp"

/// Parts that are thin or that one can look through.
namespace hueline::sim {

void add_wire(Scene& scene, Vec3 a, Vec3 b, double sag, double radius_m, std::uint16_t surface) {
  const int pieces = sag > 0 ? std::max(4, static_cast<int>(length(b - a) / 3)) : 1;
  const auto at = [&](int i) {
    const double x = static_cast<double>(i) / pieces;
    return a + x * (b - a) - Vec3{0, 0, 4 * sag * x * (1 - x)};
  };
  for (int i = 0; i < pieces; ++i) {
    const auto index = static_cast<std::uint32_t>(scene.wires.size());
    scene.wires.push_back({at(i), at(i + 1), radius_m});
    scene.sheer.rod(at(i), at(i + 1), kSheathRadius, 8, {Material::Wire, surface, index});
  }
}

namespace {

/// Wires above each lane and across the road, on poles on the left, and stays of the lamp poles on the right.
void add_overhead_wires(Scene& scene, const StreetConfig& c, const CentreLine& line, double length) {
  const std::uint16_t id = add_surface(scene, "wires"), stays = add_surface(scene, "stays");
  const double r = c.wire_mm / 2000, half = c.road_width_m / 2, front = half + 0.15 + c.pavement_width_m;
  const double step = c.pole_spacing_m, top = c.kerb_height_m;
  for (double s = -45; s + step < length + 60; s += step) {
    for (const double lateral : {-half / 2, half / 2}) {
      add_wire(scene, line.place(s, lateral, 6.3), line.place(s + step, lateral, 6.3), 0.5, r, id);
      // The lower wire is straight from hanger to hanger.
      for (double along = 0; along < step - 0.1; along += step / 5) {
        const double x = along / step;
        add_wire(scene, line.place(s + along, lateral, 5.5), line.place(s + along + step / 5, lateral, 5.5), 0, r, id);
        add_wire(scene, line.place(s + along, lateral, 5.5), line.place(s + along, lateral, 6.3 - 2 * x * (1 - x)), 0,
                 r / 2, id);
      }
    }
    add_wire(scene, line.place(s, half + 0.45, 6.6), line.place(s, -front - 0.3, 6.9), 0.35, r, id);
    for (const double up : {6.3, 6.6, 6.9})
      add_wire(scene, line.place(s + step / 2, -half - 0.45, up), line.place(s + 1.5 * step, -half - 0.45, up), 0.6, r,
               id);
    add_wire(scene, line.place(s, half + 0.45, 5.0), line.place(s + 2.2, half + 1.5, top), 0, r, stays);
  }
}

/// A fence along one kerb. Every fourth of its panels is missing.
void add_fence(Scene& scene, const StreetConfig& c, const CentreLine& line, double length, double side, bool is_bars) {
  const std::string where = side > 0 ? " right" : " left";
  const std::uint16_t id = add_surface(scene, "fence" + where), posts = add_surface(scene, "fence posts" + where);
  constexpr double kPanel = 2.5;
  const double lateral = side * (c.road_width_m / 2 + 0.2), top = c.kerb_height_m, height = is_bars ? 1.1 : 1.9;
  int number = 0;
  for (double s = -50; s < length + 60; s += kPanel, ++number) {
    if (number % 4 == 3 || (s > c.zebra_at_m - 3 && s < c.zebra_at_m + 5)) continue;
    const Vec3 a = line.place(s, lateral, top), b = line.place(s + kPanel, lateral, top), up{0, 0, height};
    scene.sheer.rectangle({a, b, b + up, a + up}, {Material::Openwork, id, is_bars ? 0u : 1u});
    for (const Vec3 foot : {a, b})
      scene.still.cylinder(foot, 0.025, 0.025, height + 0.05, 8, {Material::Steel, posts, 0});
  }
}

}  // namespace

void add_thin_things(Scene& scene, const StreetConfig& c, const CentreLine& line, double length) {
  if (c.wire_mm > 0) add_overhead_wires(scene, c, line, length);
  if (c.fence != Fence::None) {
    add_fence(scene, c, line, length, 1, c.fence != Fence::ChainLink);
    add_fence(scene, c, line, length, -1, c.fence == Fence::Bars);
  }
  if (c.stake_spacing_m > 0) {
    const std::uint16_t id = add_surface(scene, "stakes");
    const double lateral = c.road_width_m / 2 + 0.15 + 0.6 * c.pavement_width_m, top = c.kerb_height_m;
    for (double s = -40; s < length + 50; s += c.stake_spacing_m)
      for (const double side : {-1.0, 1.0})
        add_wire(scene, line.place(s, side * lateral, top), line.place(s, side * lateral, top + 1.6), 0, 0.015, id);
  }
}

void add_showroom(Scene& scene, const Pose& T, double x0, double x1, double z0, double z1, std::uint32_t number) {
  const std::string of = " " + std::to_string(number);
  const std::uint16_t room = add_surface(scene, "room" + of), goods = add_surface(scene, "display" + of),
                      frame = add_surface(scene, "frame" + of), glass = add_surface(scene, "pane" + of);
  constexpr double kDepth = 3.2, kFloor = 0.2, kCeiling = 3.0;
  const auto at = [&](double x, double y, double z) { return T * Vec3{x, y, z}; };
  Mesh& mesh = scene.still;
  const QuadTag wall{Material::Interior, room, number};
  mesh.rectangle({at(x0, kDepth, kFloor), at(x1, kDepth, kFloor), at(x1, kDepth, kCeiling), at(x0, kDepth, kCeiling)},
                 wall);
  mesh.rectangle({at(x0, 0.1, kFloor), at(x0, kDepth, kFloor), at(x0, kDepth, kCeiling), at(x0, 0.1, kCeiling)}, wall);
  mesh.rectangle({at(x1, kDepth, kFloor), at(x1, 0.1, kFloor), at(x1, 0.1, kCeiling), at(x1, kDepth, kCeiling)}, wall);
  mesh.rectangle({at(x0, 0, kFloor), at(x1, 0, kFloor), at(x1, kDepth, kFloor), at(x0, kDepth, kFloor)},
                 {Material::Wood, room, 0});
  mesh.rectangle({at(x0, kDepth, kCeiling), at(x1, kDepth, kCeiling), at(x1, 0, kCeiling), at(x0, 0, kCeiling)},
                 {Material::Stone, room, number});
  mesh.box(T, {x0 + 0.4, 2.0, kFloor}, {x0 + 0.45 * (x1 - x0), 2.5, kFloor + 0.95}, {Material::Wood, goods, 0});
  std::uint32_t clothes = number;
  for (double x = x0 + 0.8; x < x1 - 0.4; x += 1.7, ++clothes) {
    // A figure that faces the street.
    add_person(mesh, {T.R * rotation_z(kPi), at(x, 0.75, kFloor)}, goods, 1 + 2 * clothes % 8);
  }
  const auto bars = static_cast<int>(std::ceil((x1 - x0) / 1.9));
  for (int i = 0; i <= bars; ++i) {
    const double x = x0 + (x1 - x0) * i / bars;
    mesh.box(T, {x - 0.035, -0.03, z0}, {x + 0.035, 0.06, z1}, {Material::Steel, frame, 0});
  }
  mesh.box(T, {x0, -0.06, z0 - 0.05}, {x1, 0.1, z0}, {Material::Steel, frame, 0});
  scene.sheer.rectangle({at(x0, 0.02, z0), at(x1, 0.02, z0), at(x1, 0.02, z1), at(x0, 0.02, z1)},
                        {Material::Pane, glass, 0});
}

}  // namespace hueline::sim
