#include <array>
#include <cmath>

#include "sim/scene_parts.hpp"

/// An open square with slabs, flower beds within low walls, two colonnades, lamp posts with globes, benches and an
/// obelisk.
namespace hueline::sim {
namespace {

constexpr double kHalfWidth = 30;  // m from the centre line to the fronts

/// Returns a place on the square: x to the right of the drive, y along it.
Pose place(const CentreLine& line, double s, double lateral) {
  return {R_enu_body(0, 0, line.heading(s)), line.place(s, lateral)};
}

void add_column(Scene& scene, const Pose& T, std::uint32_t number) {
  const QuadTag stone{Material::Marble, add_surface(scene, "column " + std::to_string(number)), 0};
  Mesh& mesh = scene.still;
  mesh.box(T, {-0.6, -0.6, 0}, {0.6, 0.6, 0.35}, stone);
  mesh.cylinder(T * Vec3{0, 0, 0.35}, 0.46, 0.38, 5.3, 24, stone);
  mesh.box(T, {-0.55, -0.55, 5.65}, {0.55, 0.55, 5.95}, stone);
}

void add_flower_bed(Scene& scene, const Pose& T, double half_x, double half_y, Draw& draw, std::uint32_t number) {
  const std::uint16_t wall = add_surface(scene, "bed wall " + std::to_string(number)),
                      soil = add_surface(scene, "bed " + std::to_string(number));
  const std::uint16_t flowers = add_surface(scene, "flowers " + std::to_string(number));
  Mesh& mesh = scene.still;
  mesh.box(T, {-half_x, -half_y, 0}, {half_x, half_y, 0.38}, {Material::Marble, wall, 0});
  const double x = half_x - 0.18, y = half_y - 0.18;
  const auto at = [&](double a, double b, double c) { return T * Vec3{a, b, c}; };
  mesh.rectangle({at(-x, -y, 0.40), at(x, -y, 0.40), at(x, y, 0.40), at(-x, y, 0.40)}, {Material::Soil, soil, 0});
  // Each row has one colour; every plant consists of a few petals and leaves.
  const int rows = static_cast<int>(2 * y / 0.24);
  for (int row = 0; row < rows; ++row)
    for (double px = -x + 0.12; px < x; px += 0.2) {
      const double qx = px + draw(-0.04, 0.04), qy = -y + 0.12 + row * 0.24 + draw(-0.04, 0.04),
                   height = draw(0.14, 0.28);
      for (int petal = 0; petal < 3; ++petal) {
        const double about_z = draw(0, 2 * kPi), about_y = draw(-0.7, 0.7), about_x = draw(-0.7, 0.7);
        const Mat3 R = T.R * rotation_zyx(about_x, about_y, about_z);
        const double size = petal < 2 ? 0.075 : 0.10;
        const double off_y = draw(-0.03, 0.03), off_x = draw(-0.03, 0.03);
        const Vec3 c = at(qx + off_x, qy + off_y, 0.40 + (petal < 2 ? height : 0.5 * height));
        const Vec3 u = size * (R * Vec3{1, 0, 0}), v = size * (R * Vec3{0, 1, 0});
        mesh.quad({c - u, c - v, c + u, c + v}, {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}},
                  petal < 2 ? QuadTag{Material::Flower, flowers,
                                      static_cast<std::uint32_t>(row / 2 + static_cast<int>(number)) % 6}
                            : QuadTag{Material::Leaf, flowers, 0x4030});
      }
    }
}

void add_globe_lamp(Scene& scene, const Pose& T, std::uint32_t number) {
  const std::uint16_t id = add_surface(scene, "lamp " + std::to_string(number));
  scene.still.cylinder(T.p, 0.11, 0.06, 4.3, 12, {Material::Steel, id, 0});
  scene.still.rod(T * Vec3{-0.7, 0, 4.1}, T * Vec3{0.7, 0, 4.1}, 0.035, 8, {Material::Steel, id, 0});
  for (const double x : {-0.7, 0.0, 0.7})
    scene.still.ellipsoid(T * Vec3{x, 0, x == 0 ? 4.5 : 4.3}, {0.2, 0.2, 0.2}, 12, 20, {Material::TargetWhite, id, 0});
}

void add_bench(Scene& scene, const Pose& T, std::uint32_t number) {
  const std::uint16_t id = add_surface(scene, "bench " + std::to_string(number));
  for (const double y : {-0.20, -0.07, 0.06, 0.19})
    scene.still.box(T, {-0.9, y, 0.43}, {0.9, y + 0.10, 0.47}, {Material::Wood, id, 0});
  for (const double z : {0.58, 0.74})
    scene.still.box(T, {-0.9, 0.29, z}, {0.9, 0.33, z + 0.11}, {Material::Wood, id, 0});
  for (const double x : {-0.75, 0.65})
    scene.still.box(T, {x, -0.2, 0}, {x + 0.1, 0.33, 0.43}, {Material::Steel, id, 0});
}

}  // namespace

Scene build_square(const Scenario& c, const CentreLine& line, double length) {
  Scene scene;
  Draw draw{c.seed, kStreamScene + 16};
  const double from = -kStreetBehind, to = length + kStreetAhead;
  add_ribbon(scene.still, line, from, to, -kHalfWidth - 2, 0, kHalfWidth + 2, 0,
             {Material::Plaza, add_surface(scene, "slabs"), 0});
  add_plain(scene, line, length, Material::Grass);
  for (const double side : {-1.0, 1.0})
    add_houses(scene, c, line, length,
               {.side = side, .lateral_m = kHalfWidth, .base_m = 0, .least_storeys = 3, .more_storeys = 3});
  add_end(scene, c, line, draw, to - 1, -kHalfWidth, kHalfWidth);
  add_end(scene, c, line, draw, from + 1, kHalfWidth, -kHalfWidth);

  std::uint32_t columns = 0, beds = 0, lamps = 0, benches = 0, trees = 0;
  for (const double side : {-1.0, 1.0}) {
    const double near = c.drive.lane_offset_m + side * 9.0;
    // The columns carry a beam, which has one piece between neighbouring columns.
    const std::uint16_t beam = add_surface(scene, side > 0 ? "beam right" : "beam left");
    for (double s = -18; s < length + 24; s += 5) {
      add_column(scene, place(line, s, near), columns++);
      const Pose T = place(line, s + 2.5, near);
      scene.still.box(T, {-0.45, -2.5, 5.95}, {0.45, 2.5, 6.75}, {Material::Marble, beam, 0});
    }
    for (double s = -24; s < length + 30; s += 11) {
      add_flower_bed(scene, place(line, s + (side > 0 ? 0 : 4), c.drive.lane_offset_m + side * 5.2), 1.5, 3.2, draw,
                     beds++);
      add_bench(scene,
                {place(line, s, 0).R * rotation_z(-side * kPi / 2),
                 line.place(s + 5.5 + (side > 0 ? 0 : 4), c.drive.lane_offset_m + side * 5.6)},
                benches++);
      add_globe_lamp(scene, place(line, s + 5.5 + (side > 0 ? 0 : 4), c.drive.lane_offset_m + side * 3.4), lamps++);
    }
    for (double s = -30; s < length + 40; s += c.street.tree_spacing_m)
      add_tree(scene, line.place(s + draw(-1, 1), side * 20), c.street.leaves_per_tree, draw, trees++);
  }
  const Pose middle = place(line, length + 14, c.drive.lane_offset_m);
  const QuadTag granite{Material::Marble, add_surface(scene, "obelisk"), 1};
  scene.still.box(middle, {-1.4, -1.4, 0}, {1.4, 1.4, 1.2}, granite);
  scene.still.cylinder(middle * Vec3{0, 0, 1.2}, 0.75, 0.35, 8, 4, granite);
  return scene;
}

}  // namespace hueline::sim
