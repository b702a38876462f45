#include <cmath>
#include <string>
#include <utility>

#include "sim/scene_parts.hpp"

namespace hueline::sim {

std::vector<Albedo> usual_paints() {
  return {{.55f, .02f, .02f}, {.02f, .08f, .38f}, {.75f, .75f, .73f},   {.05f, .05f, .055f},
          {.70f, .50f, .03f}, {.03f, .28f, .10f}, {.38f, .40f, .42f},   {.42f, .16f, .03f},
          {.03f, .30f, .42f}, {.93f, .93f, .94f}, {.012f, .012f, .013f}};
}

std::uint32_t car_paint(const StreetConfig& street, std::uint32_t usual) {
  constexpr std::uint32_t kSnowWhite = 9;
  return street.car_paints == CarPaints::Usual ? usual : kSnowWhite + usual / 2 % 2;
}

void add_car(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint) {
  // Outline of the side, y forward and z up, from the rear bumper over the roof to the front; the cabin is narrower at
  // the top.
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
        mesh.quad({rim(i), rim(i + 1), rim(i + 2), T * Vec3{side * 0.86, y, 0.31}},
                  {{uv(i), uv(i + 1), uv(i + 2), {0, 0}}}, {Material::Tyre, surface, 0});
    }
  }
}

void add_van(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint) {
  const QuadTag body{Material::CarPaint, surface, paint}, end{Material::CarEnd, surface, paint},
      glass{Material::CarGlass, surface, paint};
  mesh.box(T, {-0.95, -2.75, 0.35}, {0.95, 1.55, 2.45}, body);
  mesh.box(T, {-0.92, 1.55, 0.35}, {0.92, 2.70, 1.10}, end);
  const auto at = [&](double x, double y, double z) { return T * Vec3{x, y, z}; };
  mesh.rectangle({at(0.9, 2.45, 1.10), at(-0.9, 2.45, 1.10), at(-0.85, 1.55, 2.2), at(0.85, 1.55, 2.2)}, glass);
  for (const double side : {-1.0, 1.0}) {
    mesh.rectangle({at(side * 0.955, 0.55, 1.25), at(side * 0.955, 1.45, 1.25), at(side * 0.955, 1.35, 2.0),
                    at(side * 0.955, 0.55, 2.0)},
                   glass);
    for (const double y : {-1.75, 1.85}) {
      const auto rim = [&](int i) {
        return at(side * 0.965, y + side * 0.36 * std::cos(i * kPi / 8), 0.36 + 0.36 * std::sin(i * kPi / 8));
      };
      const auto uv = [&](int i) { return TexturePoint{std::cos(i * kPi / 8), std::sin(i * kPi / 8)}; };
      for (int i = 0; i < 16; i += 2)
        mesh.quad({rim(i), rim(i + 1), rim(i + 2), at(side * 0.965, y, 0.36)}, {{uv(i), uv(i + 1), uv(i + 2), {0, 0}}},
                  {Material::Tyre, surface, 0});
    }
  }
}

namespace {

/// Adds the two wheels of an axle at `y`, whose outer faces are `half` from the middle.
void add_axle(Mesh& mesh, const Pose& T, double y, double half, double radius, std::uint16_t surface) {
  for (const double side : {-1.0, 1.0}) {
    const auto rim = [&](int i) {
      return T * Vec3{side * half, y + side * radius * std::cos(i * kPi / 8), radius * (1 + std::sin(i * kPi / 8))};
    };
    const auto uv = [&](int i) { return TexturePoint{std::cos(i * kPi / 8), std::sin(i * kPi / 8)}; };
    for (int i = 0; i < 16; i += 2)
      mesh.quad({rim(i), rim(i + 1), rim(i + 2), T * Vec3{side * half, y, radius}},
                {{uv(i), uv(i + 1), uv(i + 2), {0, 0}}}, {Material::Tyre, surface, 0});
  }
}

}  // namespace

/// Adds a lorry with a tarpaulin over its load: 12.4 m long, its middle at the origin of T.
void add_lorry(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t paint) {
  const QuadTag tarp{Material::Tarpaulin, surface, paint}, steel{Material::Steel, surface, 0},
      cab{Material::CarPaint, surface, paint}, glass{Material::CarGlass, surface, paint};
  mesh.box(T, {-1.25, -6.2, 1.10}, {1.25, 3.7, 4.0}, tarp);
  mesh.box(T, {-0.45, -6.1, 0.70}, {0.45, 6.0, 1.10}, steel);
  mesh.box(T, {-1.20, -2.4, 0.45}, {1.20, 2.2, 0.95}, steel);  // guards between the axles
  mesh.box(T, {-1.22, 4.1, 0.50}, {1.22, 6.2, 3.1}, cab);
  const auto at = [&](double x, double y, double z) { return T * Vec3{x, y, z}; };
  mesh.rectangle({at(1.1, 6.21, 1.75), at(-1.1, 6.21, 1.75), at(-1.1, 6.21, 2.75), at(1.1, 6.21, 2.75)}, glass);
  mesh.rectangle({at(1.0, 6.21, 0.60), at(-1.0, 6.21, 0.60), at(-1.0, 6.21, 1.05), at(1.0, 6.21, 1.05)},
                 {Material::CarEnd, surface, paint});
  mesh.rectangle({at(1.23, 4.9, 1.7), at(1.23, 6.0, 1.7), at(1.23, 5.9, 2.6), at(1.23, 4.9, 2.6)}, glass);
  mesh.rectangle({at(-1.23, 6.0, 1.7), at(-1.23, 4.9, 1.7), at(-1.23, 4.9, 2.6), at(-1.23, 5.9, 2.6)}, glass);
  for (const double y : {-4.9, -3.6, 5.0}) add_axle(mesh, T, y, 1.24, 0.48, surface);
}

/// Adds a person in mid-stride, as the laser and the lenses see a walker at one moment. The limbs do not swing.
void add_person(Mesh& mesh, const Pose& T, std::uint16_t surface, std::uint32_t clothes) {
  const QuadTag trousers{Material::Cloth, surface, (clothes + 3) % 9}, coat{Material::Cloth, surface, clothes % 9},
      skin{Material::Skin, surface, 0};
  const auto at = [&](double x, double y, double z) { return T * Vec3{x, y, z}; };
  mesh.rod(at(-0.10, 0.26, 0.04), at(-0.09, 0.02, 0.88), 0.075, 8, trousers);
  mesh.rod(at(0.10, -0.26, 0.06), at(0.09, -0.02, 0.88), 0.075, 8, trousers);
  mesh.box(T, {-0.14, 0.16, 0.0}, {-0.05, 0.42, 0.09}, {Material::Tyre, surface, 0});
  mesh.box(T, {0.05, -0.36, 0.0}, {0.14, -0.12, 0.09}, {Material::Tyre, surface, 0});
  mesh.box(T, {-0.20, -0.12, 0.80}, {0.20, 0.12, 1.46}, coat);
  mesh.rod(at(-0.25, -0.24, 0.85), at(-0.22, 0.0, 1.42), 0.055, 6, coat);
  mesh.rod(at(0.25, 0.24, 0.85), at(0.22, 0.0, 1.42), 0.055, 6, coat);
  mesh.rod(at(0, 0, 1.44), at(0, 0.01, 1.54), 0.06, 6, skin);
  mesh.ellipsoid(at(0, 0.01, 1.63), {0.095, 0.095, 0.13}, 8, 12, skin);
}

namespace {

/// Returns the shape of a road user without a surface of its own; a mover has the surface.
MovingShape shape_of(const RoadUserConfig& user) {
  const auto paint = static_cast<std::uint32_t>(user.paint);
  MovingShape shape;
  switch (user.kind) {
    case RoadUserKind::Car:
      shape.front_m = kCarFront;
      add_car(shape.mesh, {}, 0, paint);
      break;
    case RoadUserKind::Van:
      shape = {{}, 1.2, 3.4, kVanFront};
      add_van(shape.mesh, {}, 0, paint);
      break;
    case RoadUserKind::Lorry:
      shape = {{}, 2.0, 6.8, kLorryFront};
      add_lorry(shape.mesh, {}, 0, paint);
      break;
    case RoadUserKind::Person:
      shape = {{}, 0.9, 1.1};
      add_person(shape.mesh, {}, 0, paint);
      break;
  }
  return shape;
}

const char* name_of(RoadUserKind kind) {
  switch (kind) {
    case RoadUserKind::Car:
      return "car";
    case RoadUserKind::Van:
      return "van";
    case RoadUserKind::Lorry:
      return "lorry";
    case RoadUserKind::Person:
      return "person";
  }
  return "?";
}

}  // namespace

void add_headlights(Scene& scene, const Scenario& scenario) {
  const auto add_pair = [&](int carrier, double light, double aside, double ahead, double up) {
    // Each gives half of the light, at 10 m.
    const auto power = static_cast<float>(50 * light);
    for (const double x : {-aside, aside})
      scene.night_lamps.push_back({{x, ahead, up}, carrier, true, {power, 0.95f * power, 0.86f * power}});
  };
  if (scenario.drive.headlights > 0) add_pair(NightLamp::kOwnVehicle, scenario.drive.headlights, 0.65, 2.2, -0.15);
  if (scenario.street.car_lights <= 0) return;
  for (std::size_t i = 0; i < scene.movers.size(); ++i)
    if (const double front = scene.shapes[scene.movers[i].shape].front_m; front > 0)
      add_pair(static_cast<int>(i), scenario.street.car_lights, 0.62, front, 0.65);
}

void add_road_users(Scene& scene, const Scenario& scenario, double drive_length) {
  for (std::size_t i = 0; i < scenario.road_users.size(); ++i) {
    const RoadUserConfig& user = scenario.road_users[i];
    Mover mover;
    mover.shape = scene.shapes.size();
    mover.surface =
        add_surface(scene, std::string("moving ") + name_of(user.kind) + " of the list " + std::to_string(i));
    mover.s_m = user.at_m;
    mover.lateral_m = user.lateral_m;
    mover.speed = std::abs(user.speed);
    mover.along = user.speed < 0 ? -1 : 1;
    mover.to_s = drive_length + 80;
    scene.shapes.push_back(shape_of(user));
    scene.movers.push_back(mover);
  }
}

}  // namespace hueline::sim
