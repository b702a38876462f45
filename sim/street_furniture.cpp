#include <cmath>

#include "sim/noise.hpp"
#include "sim/street_scene.hpp"

namespace hueline::sim {
namespace {

/// Trunk, a few boughs, and leaves as small quads in the shell of an ellipsoid, each turned its own way.
void add_tree(StreetScene& scene, Vec3 foot, int leaves, Draw& draw, std::uint32_t tint) {
  const std::uint16_t trunk = add_surface(scene, "trunk " + std::to_string(tint)), crown = add_surface(scene, "crown " + std::to_string(tint));
  const double bole = draw(2.3, 3.0), rx = draw(1.4, 2.0), rz = draw(1.7, 2.4);
  scene.still.cylinder(foot, 0.16, 0.11, bole + 0.8, 10, {Material::Bark, trunk, tint});
  const Vec3 centre = foot + Vec3{0, 0, bole + rz * 0.8};
  for (int i = 0; i < leaves; ++i) {
    const double z = draw(-1, 1), a = draw(0, 2 * kPi), r = std::pow(draw(0.08, 1), 1.0 / 2.6);
    const double ring = std::sqrt(1 - z * z);
    // Lumps: the shell is pushed in and out so that the outline is not an egg.
    const double lump = 1 + 0.16 * std::sin(5 * a + 3 * z + tint) * ring;
    const Vec3 p = centre + Vec3{r * lump * rx * ring * std::cos(a), r * lump * rx * ring * std::sin(a), r * rz * z};
    const Mat3 R = rotation_zyx(draw(0, kPi), draw(0, kPi), draw(0, kPi));
    const double size = draw(0.09, 0.17);
    const Vec3 u = size * (R * Vec3{1, 0, 0}), v = size * (R * Vec3{0, 0.7, 0});
    scene.still.quad({p - u, p - v, p + u, p + v}, {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}},
                     {Material::Leaf, crown, static_cast<std::uint32_t>(counter_bits(draw.seed, draw.stream, draw.index++) & 0xFFFF)});
  }
}

void add_lamp(StreetScene& scene, Vec3 foot, Vec3 towards_road, std::uint32_t number) {
  const std::uint16_t id = add_surface(scene, "lamp " + std::to_string(number));
  const QuadTag steel{Material::Steel, id, 0};
  scene.still.cylinder(foot, 0.10, 0.05, 7.2, 12, steel);
  const Vec3 along = cross(Vec3{0, 0, 1}, towards_road);
  const Pose T{{{towards_road.x, along.x, 0, towards_road.y, along.y, 0, 0, 0, 1}}, foot + Vec3{0, 0, 7.1}};
  scene.still.box(T, {-0.05, -0.04, 0}, {1.5, 0.04, 0.08}, steel);
  scene.still.box(T, {1.1, -0.14, 0.05}, {1.8, 0.14, 0.16}, steel);
}

/// Pole with a round sign that faces oncoming traffic.
void add_sign(StreetScene& scene, Vec3 foot, Vec3 facing, std::uint32_t paint) {
  const std::uint16_t id = add_surface(scene, "sign " + std::to_string(paint));
  scene.still.cylinder(foot, 0.035, 0.035, 2.9, 8, {Material::Steel, id, 0});
  const Vec3 right = cross(Vec3{0, 0, 1}, facing);
  const Vec3 centre = foot + Vec3{0, 0, 2.55} + 0.05 * facing;
  const double r = 0.36;
  const auto rim = [&](int i) { return centre + r * std::cos(i * kPi / 8) * right + r * std::sin(i * kPi / 8) * Vec3{0, 0, 1}; };
  const auto uv = [&](int i) { return TexturePoint{std::cos(i * kPi / 8), std::sin(i * kPi / 8)}; };
  for (int i = 0; i < 16; i += 2)
    scene.still.quad({rim(i), rim(i + 1), rim(i + 2), centre}, {{uv(i), uv(i + 1), uv(i + 2), {0, 0}}}, {Material::SignFace, id, paint});
}

}  // namespace

void add_car(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint) {
  // Outline of the side, y forward and z up, from the rear bumper round over the roof; the cabin is narrower on top.
  struct Rib {
    double y, z, half_width;
    Material material;  ///< of the piece up to the next rib
  };
  static constexpr std::array<Rib, 9> kRibs{{{-2.12, 0.32, 0.80, Material::CarEnd},
                                             {-2.16, 0.86, 0.84, Material::CarPaint},
                                             {-1.95, 0.98, 0.84, Material::CarGlass},
                                             {-1.45, 1.42, 0.66, Material::CarPaint},
                                             {0.10, 1.45, 0.66, Material::CarGlass},
                                             {0.85, 0.98, 0.82, Material::CarPaint},
                                             {1.95, 0.80, 0.80, Material::CarEnd},
                                             {2.12, 0.62, 0.78, Material::CarEnd},
                                             {2.10, 0.30, 0.76, Material::CarEnd}}};
  for (std::size_t i = 0; i + 1 < kRibs.size(); ++i) {
    const Rib &a = kRibs[i], &b = kRibs[i + 1];
    const double step = std::hypot(b.y - a.y, b.z - a.z);
    mesh.quad({T * Vec3{-a.half_width, a.y, a.z}, T * Vec3{a.half_width, a.y, a.z}, T * Vec3{b.half_width, b.y, b.z},
               T * Vec3{-b.half_width, b.y, b.z}},
              {{{-a.half_width, 0}, {a.half_width, 0}, {b.half_width, step}, {-b.half_width, step}}},
              {a.material, surface, paint});
  }
  for (const double side : {-1.0, 1.0}) {
    const auto wall = [&](std::array<std::array<double, 3>, 4> yzw, Material material) {
      std::array<Vec3, 4> p;
      std::array<TexturePoint, 4> t;
      for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t k = side > 0 ? i : 3 - i;
        p[k] = T * Vec3{side * yzw[i][2], yzw[i][0], yzw[i][1]};
        t[k] = {yzw[i][0], yzw[i][1]};
      }
      mesh.quad(p, t, {material, surface, paint});
    };
    wall({{{-2.12, .32, .80}, {-0.2, .26, .84}, {-0.2, .92, .84}, {-2.16, .86, .84}}}, Material::CarPaint);
    wall({{{-0.2, .26, .84}, {2.10, .30, .76}, {2.12, .62, .78}, {-0.2, .92, .84}}}, Material::CarPaint);
    wall({{{-0.2, .92, .84}, {2.12, .62, .78}, {1.95, .80, .80}, {0.85, .98, .82}}}, Material::CarPaint);
    wall({{{-2.16, .86, .84}, {0.85, .90, .83}, {0.85, .98, .82}, {-1.95, .98, .84}}}, Material::CarPaint);
    wall({{{-1.95, .98, .84}, {0.85, .98, .82}, {0.10, 1.45, .66}, {-1.45, 1.42, .66}}}, Material::CarGlass);
    for (const double y : {-1.35, 1.30}) {
      const auto rim = [&](int i) {
        return T * Vec3{side * 0.86, y + side * 0.31 * std::cos(i * kPi / 8), 0.31 + 0.31 * std::sin(i * kPi / 8)};
      };
      const auto uv = [&](int i) { return TexturePoint{std::cos(i * kPi / 8), std::sin(i * kPi / 8)}; };
      for (int i = 0; i < 16; i += 2)
        mesh.quad({rim(i), rim(i + 1), rim(i + 2), T * Vec3{side * 0.86, y, 0.31}}, {{uv(i), uv(i + 1), uv(i + 2), {0, 0}}},
                  {Material::Tyre, surface, 0});
    }
  }
}

void add_furniture(StreetScene& scene, const Scenario& c, const CentreLine& line, double length) {
  scene.paints = {{.55f, .02f, .02f}, {.02f, .08f, .38f}, {.75f, .75f, .73f}, {.05f, .05f, .055f}, {.70f, .50f, .03f},
                  {.03f, .28f, .10f}, {.38f, .40f, .42f}, {.42f, .16f, .03f}, {.03f, .30f, .42f}};
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
      add_lamp(scene, foot, normalised(line.place(at, 0, top) - foot), number++);
    }
  for (const double offset : {-3.0, 6.5}) {
    const double side = offset < 0 ? 1.0 : -1.0, s = c.street.zebra_at_m + offset;
    const Vec3 forward = normalised(line.place(s + 1, 0) - line.place(s, 0));
    add_sign(scene, line.place(s, side * (half + 0.4), top), -side * forward, offset < 0 ? 1 : 0);
  }
  number = 0;
  for (int i = 0; i < c.street.parked_cars; ++i) {
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    // Between two trees of its side, nose with the traffic.
    const double slot = std::floor(i * (length + 60) / c.street.tree_spacing_m / c.street.parked_cars);
    const double s = -20 + c.street.tree_spacing_m * (slot + 0.5) + (side > 0 ? 0 : c.street.tree_spacing_m / 3);
    if (near_zebra(s)) continue;
    const double h = line.heading(s) + (side > 0 ? 0 : kPi);
    const std::uint16_t id = add_surface(scene, "parked car " + std::to_string(number++));
    add_car(scene.still, {R_enu_body(0, 0, h), line.place(s, side * (half + 1.15), top)}, id, static_cast<std::uint32_t>(i % 9));
  }
  add_car(scene.car, {}, 0, 4);
  for (int i = 0; i < c.street.moving_cars; ++i)
    scene.moving_car_surfaces.push_back(add_surface(scene, "moving car " + std::to_string(i)));
}

}  // namespace hueline::sim
