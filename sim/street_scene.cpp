#include <algorithm>
#include <cmath>

#include "sim/scene_parts.hpp"

namespace hueline::sim {
void add_ribbon(Mesh& mesh, const CentreLine& line, double from, double to, double left, double z_left, double right,
                double z_right, QuadTag tag) {
  for (double s = from; s < to; s += 1.0) {
    const double e = std::min(s + 1.0, to);
    const double vl = z_left == z_right ? left : 0.0,
                 vr = z_left == z_right ? right : std::hypot(right - left, z_right - z_left);
    mesh.quad({line.place(s, left, z_left), line.place(s, right, z_right), line.place(e, right, z_right),
               line.place(e, left, z_left)},
              {{{s, vl}, {s, vr}, {e, vr}, {e, vl}}}, tag);
  }
}

namespace {
void plain(Scene& scene, const CentreLine& line, double length, QuadTag tag) {
  const Vec3 middle = line.place(length / 2, 0, -0.08);
  const double r = 500;
  scene.still.rectangle(
      {middle + Vec3{-r, -r, 0}, middle + Vec3{r, -r, 0}, middle + Vec3{r, r, 0}, middle + Vec3{-r, r, 0}}, tag);
}
}  // namespace

void add_road(Scene& scene, const StreetConfig& c, const CentreLine& line, double length) {
  const double from = -kStreetBehind, to = length + kStreetAhead, half = c.road_width_m / 2, kerb = 0.15,
               top = c.kerb_height_m;
  const double walk = half + kerb + c.pavement_width_m;
  add_ribbon(scene.still, line, from, to, -half, 0, half, 0, {Material::Asphalt, add_surface(scene, "road"), 0});
  const std::uint16_t kerbs = add_surface(scene, "kerb"), walks = add_surface(scene, "pavement"),
                      grass = add_surface(scene, "grass");
  for (const double side : {-1.0, 1.0}) {
    // From left to right across the drive on both sides, so that the faces look up.
    const auto strip = [&](double near, double z_near, double far, double z_far, QuadTag tag) {
      if (side > 0)
        add_ribbon(scene.still, line, from, to, near, z_near, far, z_far, tag);
      else
        add_ribbon(scene.still, line, from, to, -far, z_far, -near, z_near, tag);
    };
    strip(half, 0, half + 0.015, top, {Material::Kerb, kerbs, 0});
    strip(half + 0.015, top, half + kerb, top, {Material::Kerb, kerbs, 0});
    strip(half + kerb, top, walk + 0.8, top, {Material::Pavement, walks, 0});
    strip(walk + 0.8, top, walk + 24, top, {Material::Grass, grass, 0});
  }
  plain(scene, line, length, {Material::Grass, grass, 0});
}

void add_plain(Scene& scene, const CentreLine& line, double length, Material material) {
  plain(scene, line, length, {material, add_surface(scene, "plain"), 0});
}

FacadeStyle draw_facade(Draw& draw, double width, std::uint32_t least_storeys, std::uint32_t more_storeys) {
  static constexpr std::array<Albedo, 8> kWalls{{{.62f, .55f, .42f},
                                                 {.45f, .17f, .11f},
                                                 {.70f, .66f, .58f},
                                                 {.33f, .42f, .50f},
                                                 {.62f, .38f, .22f},
                                                 {.42f, .48f, .33f},
                                                 {.68f, .50f, .48f},
                                                 {.50f, .49f, .47f}}};
  static constexpr std::array<Albedo, 7> kSigns{{{.70f, .04f, .04f},
                                                 {.85f, .62f, .02f},
                                                 {.03f, .16f, .60f},
                                                 {.02f, .42f, .12f},
                                                 {.60f, .05f, .42f},
                                                 {.02f, .45f, .50f},
                                                 {.80f, .28f, .02f}}};
  FacadeStyle f;
  const auto wall = draw.below(8);
  f.wall = kWalls[wall];
  f.is_brick = wall == 1 || wall == 4;
  f.trim = f.is_brick ? Albedo{.72f, .69f, .62f} : Albedo{.80f, .79f, .76f};
  f.sign = kSigns[draw.below(7)];
  f.door = kSigns[draw.below(7)];
  f.width_m = width;
  f.storey_m = draw(2.9, 3.4);
  f.height_m = 4.0 + f.storey_m * (least_storeys - 1 + draw.below(more_storeys)) + 0.8;
  f.bay_m = width / std::floor(width / draw(2.1, 2.9));
  f.window_width_m = f.bay_m * draw(0.42, 0.6);
  f.window_height_m = draw(1.5, 1.9);
  f.has_shop = draw(0, 1) < 0.6;
  f.seed = static_cast<std::uint32_t>(counter_bits(draw.seed, draw.stream, draw.index++));
  return f;
}

void add_building(Scene& scene, Vec3 a, Vec3 b, double base, double depth, const FacadeStyle& style, bool furnished) {
  const auto index = static_cast<std::uint32_t>(scene.facades.size());
  scene.facades.push_back(style);
  const std::uint16_t front = add_surface(scene, "facade " + std::to_string(index));
  const Vec3 along = normalised(b - a), back = cross(Vec3{0, 0, 1}, along);  // away from the street
  // Building frame: x along the front from a, y into the house, z up.
  const Pose T{{{along.x, back.x, 0, along.y, back.y, 0, 0, 0, 1}}, {a.x, a.y, base}};
  const double w = style.width_m, h = style.height_m;
  const auto at = [&](double x, double y, double z) { return T * Vec3{x, y, z}; };
  Mesh& mesh = scene.still;
  const auto wall = [&](double x0, double x1, double z0, double z1) {
    mesh.quad({at(x0, 0, z0), at(x1, 0, z0), at(x1, 0, z1), at(x0, 0, z1)}, {{{x0, z0}, {x1, z0}, {x1, z1}, {x0, z1}}},
              {Material::Facade, front, index});
  };
  if (style.is_glazed) {
    // The wall around the opening has the texture that a whole wall has there.
    const double x0 = 0.6, x1 = 0.72 * w - 0.35, z0 = 0.4, z1 = 2.85;
    wall(0, x0, 0, h);
    wall(x1, w, 0, h);
    wall(x0, x1, 0, z0);
    wall(x0, x1, z1, h);
    add_showroom(scene, T, x0, x1, z0, z1, index);
  } else {
    mesh.rectangle({at(0, 0, 0), at(w, 0, 0), at(w, 0, h), at(0, 0, h)}, {Material::Facade, front, index});
  }
  mesh.rectangle({at(w, 0, 0), at(w, depth, 0), at(w, depth, h), at(w, 0, h)}, {Material::SideWall, front, index});
  mesh.rectangle({at(0, depth, 0), at(0, 0, 0), at(0, 0, h), at(0, depth, h)}, {Material::SideWall, front, index});
  mesh.rectangle({at(w, depth, 0), at(0, depth, 0), at(0, depth, h), at(w, depth, h)},
                 {Material::SideWall, front, index});
  mesh.rectangle({at(0, 0, h), at(w, 0, h), at(w, depth, h), at(0, depth, h)}, {Material::Roof, front, index});
  if (!furnished) return;
  // Parts that stand out give the laser depth: cornice, string course, balconies, an awning over the shop.
  const std::uint16_t stone = add_surface(scene, "stonework " + std::to_string(index));
  mesh.box(T, {-0.05, -0.35, h - 0.35}, {w + 0.05, 0.0, h}, {Material::Stone, stone, index});
  mesh.box(T, {0, -0.12, 3.72}, {w, 0.0, 3.95}, {Material::Stone, stone, index});
  if (style.has_shop) {
    const double x0 = 0.8, x1 = w * 0.55;
    mesh.rectangle({at(x0, -1.3, 2.45), at(x1, -1.3, 2.45), at(x1, -0.02, 2.95), at(x0, -0.02, 2.95)},
                   {Material::Awning, stone, index});
    mesh.rectangle({at(x0, -1.3, 2.25), at(x1, -1.3, 2.25), at(x1, -1.3, 2.45), at(x0, -1.3, 2.45)},
                   {Material::Awning, stone, index});
  }
  if (style.seed % 3 == 0) {
    for (double z = 4.0; z + style.storey_m < h; z += style.storey_m)
      for (double x = style.bay_m / 2; x + 0.9 < w; x += 2 * style.bay_m)
        mesh.box(T, {x - 0.95, -0.9, z + 0.15}, {x + 0.95, 0, z + 0.95}, {Material::Stone, stone, index});
  }
}

void add_houses(Scene& scene, const Scenario& c, const CentreLine& line, double drive_length, const RowOfHouses& row) {
  const double side = row.side;
  Draw draw{c.seed, kStreamScene + (side > 0 ? 1u : 0u)};
  const std::uint16_t fence = add_surface(scene, side > 0 ? "garden wall right" : "garden wall left");
  double s = -kStreetBehind;
  while (s < drive_length + kStreetAhead) {
    const double width = draw(9, 16), offset = side * (row.lateral_m + draw(0, 0.5));
    // Somebody who faces the houses on the right has the direction of the drive on the left.
    const double s0 = side > 0 ? s + width : s, s1 = side > 0 ? s : s + width;
    const Vec3 a = line.place(s0, offset), b = line.place(s1, offset);
    if (draw(0, 1) < 0.13 && c.street.furnished) {
      const double top = row.base_m + 1.7;
      scene.still.rectangle({a, b, b + Vec3{0, 0, top}, a + Vec3{0, 0, top}}, {Material::Brick, fence, 0});
    } else {
      FacadeStyle style = draw_facade(draw, length(b - a), row.least_storeys, row.more_storeys);
      style.is_glazed = static_cast<double>(scrambled(style.seed) >> 11) * 0x1p-53 < c.street.glazed_fronts;
      add_building(scene, a, b, row.base_m, 11.0, style, c.street.furnished);
    }
    s += width + (draw(0, 1) < 0.2 ? 1.2 : 0.02);
  }
}

void add_end(Scene& scene, const Scenario& c, const CentreLine& line, Draw& draw, double s, double left, double right) {
  const Vec3 a = line.place(s, left), b = line.place(s, right);
  add_building(scene, a, b, 0, 11, draw_facade(draw, length(b - a), 2, 3), c.street.furnished);
}

Scene build_street(const Scenario& c, const CentreLine& line, double drive_length) {
  Scene scene;
  add_road(scene, c.street, line, drive_length);
  const double lateral = c.street.road_width_m / 2 + 0.15 + c.street.pavement_width_m, kerb = c.street.kerb_height_m;
  add_houses(scene, c, line, drive_length, {.side = -1, .lateral_m = lateral, .base_m = kerb});
  add_houses(scene, c, line, drive_length, {.side = 1, .lateral_m = lateral, .base_m = kerb});
  // A house across the street closes each of its ends.
  Draw draw{c.seed, kStreamScene + 2};
  const double across = c.street.road_width_m / 2 + c.street.pavement_width_m + 4;
  add_end(scene, c, line, draw, drive_length + kStreetAhead - 1, -across, across);
  add_end(scene, c, line, draw, -kStreetBehind + 1, across, -across);
  if (c.street.furnished) add_furniture(scene, c, line, drive_length);
  return scene;
}

/// The street between tall houses. It is open at both ends, so that a low sun shines along it.
Scene build_canyon(const Scenario& c, const CentreLine& line, double drive_length) {
  Scene scene;
  add_road(scene, c.street, line, drive_length);
  const double lateral = c.street.road_width_m / 2 + 0.15 + c.street.pavement_width_m, kerb = c.street.kerb_height_m;
  add_houses(scene, c, line, drive_length,
             {.side = -1, .lateral_m = lateral, .base_m = kerb, .least_storeys = 6, .more_storeys = 4});
  add_houses(scene, c, line, drive_length,
             {.side = 1, .lateral_m = lateral, .base_m = kerb, .least_storeys = 5, .more_storeys = 5});
  if (c.street.furnished) add_furniture(scene, c, line, drive_length);
  return scene;
}

}  // namespace hueline::sim
