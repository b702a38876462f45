#include <cmath>

#include "sim/scene_parts.hpp"

namespace hueline::sim {

/// Adds a tree: a trunk, a few boughs, and leaves as small quads with random directions in the shell of an ellipsoid.
void add_tree(Scene& scene, Vec3 foot, int leaves, Draw& draw, std::uint32_t tint) {
  const std::uint16_t trunk = add_surface(scene, "trunk " + std::to_string(tint)),
                      crown = add_surface(scene, "crown " + std::to_string(tint));
  const double bole = draw(2.3, 3.0), rx = draw(1.4, 2.0), rz = draw(1.7, 2.4);
  scene.still.cylinder(foot, 0.16, 0.11, bole + 0.8, 10, {Material::Bark, trunk, tint});
  const Vec3 centre = foot + Vec3{0, 0, bole + rz * 0.8};
  for (int i = 0; i < leaves; ++i) {
    const double z = draw(-1, 1), a = draw(0, 2 * kPi), r = std::pow(draw(0.08, 1), 1.0 / 2.6);
    const double ring = std::sqrt(1 - z * z);
    // The shell is pushed in and out, so that the outline has lumps and is not an egg.
    const double lump = 1 + 0.16 * std::sin(5 * a + 3 * z + tint) * ring;
    const Vec3 p = centre + Vec3{r * lump * rx * ring * std::cos(a), r * lump * rx * ring * std::sin(a), r * rz * z};
    const double about_z = draw(0, kPi), about_y = draw(0, kPi), about_x = draw(0, kPi);
    const Mat3 R = rotation_zyx(about_x, about_y, about_z);
    const double size = draw(0.09, 0.17);
    const Vec3 u = size * (R * Vec3{1, 0, 0}), v = size * (R * Vec3{0, 0.7, 0});
    scene.still.quad({p - u, p - v, p + u, p + v}, {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}},
                     {Material::Leaf, crown,
                      static_cast<std::uint32_t>(counter_bits(draw.seed, draw.stream, draw.index++) & 0xFFFF)});
  }
}

void add_lamp(Scene& scene, const StreetConfig& street, Vec3 foot, Vec3 towards_road, std::uint32_t number) {
  const std::uint16_t id = add_surface(scene, "lamp " + std::to_string(number));
  const QuadTag steel{Material::Steel, id, 0};
  scene.still.cylinder(foot, 0.10, 0.05, 7.2, 12, steel);
  const Vec3 along = cross(Vec3{0, 0, 1}, towards_road);
  const Pose T{{{towards_road.x, along.x, 0, towards_road.y, along.y, 0, 0, 0, 1}}, foot + Vec3{0, 0, 7.1}};
  scene.still.box(T, {-0.05, -0.04, 0}, {1.5, 0.04, 0.08}, steel);
  scene.still.box(T, {1.1, -0.14, 0.05}, {1.8, 0.14, 0.16}, steel);
  if (street.lamp_light <= 0) return;
  const auto at = [&](double x, double y) { return T * Vec3{x, y, 0.045}; };
  scene.still.rectangle({at(1.12, 0.12), at(1.78, 0.12), at(1.78, -0.12), at(1.12, -0.12)},
                        {Material::LampGlass, id, 0});
  const auto light = static_cast<float>(street.lamp_light);
  scene.night_lamps.push_back(
      {T * Vec3{1.45, 0, -0.03}, NightLamp::kStill, false, {light, 0.80f * light, 0.52f * light}});
}

namespace {

/// Adds a pole with a round sign that faces oncoming traffic.
void add_sign(Scene& scene, Vec3 foot, Vec3 facing, std::uint32_t paint) {
  const std::uint16_t id = add_surface(scene, "sign " + std::to_string(paint));
  scene.still.cylinder(foot, 0.035, 0.035, 2.9, 8, {Material::Steel, id, 0});
  const Vec3 right = cross(Vec3{0, 0, 1}, facing);
  const Vec3 centre = foot + Vec3{0, 0, 2.55} + 0.05 * facing;
  const double r = 0.36;
  const auto rim = [&](int i) {
    return centre + r * std::cos(i * kPi / 8) * right + r * std::sin(i * kPi / 8) * Vec3{0, 0, 1};
  };
  const auto uv = [&](int i) { return TexturePoint{std::cos(i * kPi / 8), std::sin(i * kPi / 8)}; };
  for (int i = 0; i < 16; i += 2)
    scene.still.quad({rim(i), rim(i + 1), rim(i + 2), centre}, {{uv(i), uv(i + 1), uv(i + 2), {0, 0}}},
                     {Material::SignFace, id, paint});
}

}  // namespace

void add_furniture(Scene& scene, const Scenario& c, const CentreLine& line, double length) {
  const double half = c.street.road_width_m / 2, top = c.street.kerb_height_m;
  Draw draw{c.seed, kStreamScene + 8};
  std::uint32_t number = 0;
  const auto near_zebra = [&](double s) { return s > c.street.zebra_at_m - 8 && s < c.street.zebra_at_m + 12; };
  for (double s = -52; s < length + 66; s += c.street.tree_spacing_m)
    for (const double side : {-1.0, 1.0}) {
      const double at = s + draw(-0.7, 0.7) + (side > 0 ? 0 : c.street.tree_spacing_m / 3);
      if (near_zebra(at)) continue;
      add_tree(scene, line.place(at, side * (half + 0.95), top), c.street.leaves_per_tree, draw, number++);
    }
  number = 0;
  for (double s = -45; s < length + 60; s += c.street.pole_spacing_m)
    for (const double side : {-1.0, 1.0}) {
      const double at = s + (side > 0 ? 0 : c.street.pole_spacing_m / 2);
      const Vec3 foot = line.place(at, side * (half + 0.45), top);
      add_lamp(scene, c.street, foot, normalised(line.place(at, 0, top) - foot), number++);
    }
  for (const double offset : {-3.0, 6.5}) {
    const double side = offset < 0 ? 1.0 : -1.0, s = c.street.zebra_at_m + offset;
    const Vec3 forward = normalised(line.place(s + 1, 0) - line.place(s, 0));
    add_sign(scene, line.place(s, side * (half + 0.4), top), -side * forward, offset < 0 ? 1 : 0);
  }
  add_thin_things(scene, c.street, line, length);
  number = 0;
  for (int i = 0; i < c.street.parked_cars; ++i) {
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    // Cars are parked between two trees of their side, in the direction of the traffic.
    const double slot = std::floor(i * (length + 60) / c.street.tree_spacing_m / c.street.parked_cars);
    const double s = -20 + c.street.tree_spacing_m * (slot + 0.5) + (side > 0 ? 0 : c.street.tree_spacing_m / 3);
    if (near_zebra(s)) continue;
    const double h = line.heading(s) + (side > 0 ? 0 : kPi);
    const std::uint16_t id = add_surface(scene, "parked car " + std::to_string(number++));
    add_car(scene.still, {R_enu_body(0, 0, h), line.place(s, side * (half + 1.15), top)}, id,
            car_paint(c.street, static_cast<std::uint32_t>(i % 9)));
  }
  if (c.scene == SceneKind::Traffic) return;
  scene.shapes.emplace_back();
  scene.shapes.back().front_m = kCarFront;
  add_car(scene.shapes.back().mesh, {}, 0, car_paint(c.street, 4));
  for (int i = 0; i < c.street.moving_cars; ++i) {
    Mover car;
    car.surface = add_surface(scene, "moving car " + std::to_string(i));
    car.s_m = length + 55 + 120.0 * static_cast<double>(i);
    car.lateral_m = -c.street.road_width_m / 4;
    car.speed = c.street.moving_car_speed;
    car.to_s = length + 80;
    scene.movers.push_back(car);
  }
}

}  // namespace hueline::sim
