#include <cmath>

#include "sim/scene_parts.hpp"

/// A narrow alley: cobbles from wall to wall, fronts at different distances, pipes, steps, and lines with washing.
namespace hueline::sim {
namespace {

/// Adds one side of the alley: fronts of 4 to 8 m width, each at its own distance.
void add_side(Scene& scene, const Scenario& c, const CentreLine& line, double length, double side) {
  Draw draw{c.seed, kStreamScene + (side > 0 ? 25u : 24u)};
  const std::uint16_t pipe = add_surface(scene, side > 0 ? "pipes right" : "pipes left"),
                      step = add_surface(scene, side > 0 ? "steps right" : "steps left");
  const std::uint16_t bin = add_surface(scene, side > 0 ? "bins right" : "bins left"),
                      pots = add_surface(scene, side > 0 ? "pots right" : "pots left");
  double s = -kStreetBehind, distance = 0.5 * (c.alley.near_m + c.alley.far_m);
  while (s < length + kStreetAhead) {
    const double width = draw(4.5, 8.0);
    // The distance changes by a part of the range from one front to the next, so that the walls form an alley and not a
    // row of niches.
    const double wanted = draw(c.alley.near_m, c.alley.far_m);
    distance += 0.6 * (wanted - distance);
    if (draw(0, 1) < 0.25) distance = wanted;
    const double lateral = c.drive.lane_offset_m + side * distance;
    const double s0 = side > 0 ? s + width : s, s1 = side > 0 ? s : s + width;
    const Vec3 a = line.place(s0, lateral), b = line.place(s1, lateral);
    FacadeStyle style = draw_facade(draw, length == 0 ? width : hueline::sim::length(b - a), 3, 2);
    style.has_shop = style.has_shop && draw(0, 1) < 0.35;
    add_building(scene, a, b, 0, 8, style, false);
    const Pose T{R_enu_body(0, 0, line.heading(s)), {}};
    const auto on_wall = [&](double along, double out, double up) {
      return line.place(s + along, lateral - side * out, up);
    };
    scene.still.rod(on_wall(0.25, 0.08, 0.1), on_wall(0.25, 0.08, style.height_m - 0.2), 0.05, 8,
                    {Material::Steel, pipe, 0});
    // Sills stand out from the wall under each upper window. They are short edges close to the lenses.
    for (double z = 3.95 + 0.62; z + style.storey_m < style.height_m + 0.3; z += style.storey_m)
      for (double x = style.bay_m / 2; x + 0.4 < width; x += style.bay_m) {
        const Pose sill{T.R, on_wall(x, 0.0, z)};
        scene.still.box(sill, {-0.14, -0.55 * style.window_width_m, 0}, {0.14, 0.55 * style.window_width_m, 0.1},
                        {Material::Marble, step, 1});
      }
    const Pose door{T.R, on_wall(side > 0 ? width - 0.72 * style.width_m - 0.6 : 0.72 * style.width_m + 0.6, 0.3, 0)};
    scene.still.box(door, {-0.3, -0.75, 0}, {0.3, 0.75, 0.16}, {Material::Marble, step, 0});
    if (distance > c.alley.near_m + 0.7 && draw(0, 1) < 0.6) {
      const Pose at{T.R, on_wall(draw(0.8, width - 0.8), 0.35, 0)};
      if (draw(0, 1) < 0.5) {
        scene.still.box(at, {-0.29, -0.29, 0.06}, {0.29, 0.29, 1.05}, {Material::CarPaint, bin, draw.below(9)});
      } else {
        scene.still.cylinder(at.p, 0.22, 0.28, 0.45, 14, {Material::Brick, pots, 0});
        scene.still.ellipsoid(at.p + Vec3{0, 0, 0.7}, {0.34, 0.34, 0.38}, 8, 12, {Material::Leaf, pots, 0x5060});
      }
    }
    s += width + 0.01;
  }
}

void add_washing(Scene& scene, const Scenario& c, const CentreLine& line, double length) {
  Draw draw{c.seed, kStreamScene + 26};
  const std::uint16_t rope = add_surface(scene, "ropes"), cloth = add_surface(scene, "washing");
  for (double s = 4; s < length + 40; s += draw(9, 15)) {
    const double up = draw(5.0, 6.5), reach = c.alley.far_m, lane = c.drive.lane_offset_m;
    scene.still.rod(line.place(s, lane - reach, up), line.place(s, lane + reach, up), 0.012, 5,
                    {Material::Steel, rope, 0});
    for (double x = lane - 1.6; x < lane + 1.4; x += draw(0.7, 1.1)) {
      const double drop = draw(0.5, 1.0), wide = draw(0.35, 0.6);
      scene.still.rectangle({line.place(s, x, up - drop), line.place(s, x + wide, up - drop),
                             line.place(s, x + wide, up), line.place(s, x, up)},
                            {Material::Cloth, cloth, draw.below(9)});
    }
  }
}

}  // namespace

Scene build_alley(const Scenario& c, const CentreLine& line, double length) {
  Scene scene;
  Draw draw{c.seed, kStreamScene + 2};
  const double lane = c.drive.lane_offset_m, reach = c.alley.far_m + 0.5;
  add_ribbon(scene.still, line, -kStreetBehind, length + kStreetAhead, lane - reach, 0, lane + reach, 0,
             {Material::Cobble, add_surface(scene, "cobbles"), 0});
  add_plain(scene, line, length, Material::Grass);
  add_side(scene, c, line, length, -1);
  add_side(scene, c, line, length, 1);
  add_end(scene, c, line, draw, length + kStreetAhead - 1, lane - reach, lane + reach);
  add_end(scene, c, line, draw, -kStreetBehind + 1, lane + reach, lane - reach);
  if (c.street.furnished) add_washing(scene, c, line, length);
  return scene;
}

}  // namespace hueline::sim
