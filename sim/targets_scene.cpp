#include <algorithm>
#include <array>
#include <cmath>

#include "sim/scene_parts.hpp"
#include "sim/texture.hpp"

/// A gravel pit surrounded by benches of rock, with spheres on tripods in the open and other things that could be
/// mistaken for them.
namespace hueline::sim {
namespace {

constexpr double kLargeRadius = 0.145, kSmallRadius = 0.0725;
constexpr double kRim = 95;  // m

/// Returns by how much the benches stand forward or back at an azimuth, so that their plan is not a circle. Zero within
/// 22 m.
double bay(double rho, double a) {
  const double n = smooth_noise(static_cast<float>(3 * std::cos(a)) + 5, static_cast<float>(3 * std::sin(a)), 0, 83);
  return 4.0 * n * std::clamp((rho - 22) / 10, 0.0, 1.0);
}

constexpr std::array<double, 3> kBenchAt{33, 46, 62}, kBenchHeight{5.5, 7, 8};
constexpr double kBenchRun = 2.4;  // the face of a bench leans back by this much, m

/// Returns the ground at polar coordinates (rho, a) around the vehicle: level where it stands, uneven farther out, with
/// three benches.
Vec3 ground(double rho, double a) {
  const double r = rho - bay(rho, a);
  const Vec3 flat{r * std::cos(a), r * std::sin(a), 0};
  const auto x = static_cast<float>(flat.x), y = static_cast<float>(flat.y);
  const double rough = smooth_noise(x / 7, y / 7, 0, 81) + 0.4 * smooth_noise(x / 2.3f, y / 2.3f, 0, 82);
  double up = 0.16 * rough * std::clamp((rho - 3.5) / 6, 0.0, 1.0);
  for (std::size_t i = 0; i < kBenchAt.size(); ++i)
    up += kBenchHeight[i] * std::clamp((rho - kBenchAt[i]) / kBenchRun, 0.0, 1.0);
  return flat + Vec3{0, 0, up};
}

bool is_face(double rho) {
  return std::any_of(kBenchAt.begin(), kBenchAt.end(),
                     [&](double at) { return rho > at - 0.01 && rho < at + kBenchRun - 0.01; });
}

void add_pit(Scene& scene, Vec3 centre) {
  const std::uint16_t gravel = add_surface(scene, "gravel"), rock = add_surface(scene, "rock");
  constexpr int kAround = 180;
  // The rings follow the edges of the benches.
  std::vector<double> rings;
  for (double r = 0.5; r < kRim; r += r < 25 ? 0.5 + 0.02 * r : 1.0) rings.push_back(r);
  for (const double at : kBenchAt)
    for (int i = 0; i <= 4; ++i) rings.push_back(at + kBenchRun * i / 4);
  std::sort(rings.begin(), rings.end());
  const auto angle = [&](int i) { return 2 * kPi * i / kAround; };
  const auto at = [&](int i, double rho) { return centre + ground(rho, angle(i % kAround)); };
  for (int i = 0; i < kAround; ++i)
    for (std::size_t k = 0; k + 1 < rings.size(); ++k) {
      if (rings[k + 1] - rings[k] < 1e-6) continue;
      const std::array<Vec3, 4> p{at(i, rings[k]), at(i, rings[k + 1]), at(i + 1, rings[k + 1]), at(i + 1, rings[k])};
      const bool face = is_face(rings[k]);
      const auto uv = [&](int corner, int j) {
        const Vec3 q = p[static_cast<std::size_t>(corner)];
        return face ? TexturePoint{45 * angle(j), q.z} : TexturePoint{q.x - centre.x, q.y - centre.y};
      };
      scene.still.quad(p, {{uv(0, i), uv(1, i), uv(2, i + 1), uv(3, i + 1)}},
                       {face ? Material::Rock : Material::Gravel, face ? rock : gravel, 0});
    }
  const double r = rings.front();
  for (int i = 0; i < kAround; i += 2)
    scene.still.quad({centre, at(i, r), at(i + 1, r), at(i + 2, r)}, {{{0, 0}, {r, 0}, {r, 0.02}, {r, 0.04}}},
                     {Material::Gravel, gravel, 0});
}

void add_tripod(Scene& scene, Vec3 foot, double height, std::uint16_t surface, double turn) {
  const Vec3 head = foot + Vec3{0, 0, height};
  for (int leg = 0; leg < 3; ++leg) {
    const double a = turn + 2 * kPi * leg / 3;
    scene.still.rod(foot + Vec3{0.45 * std::cos(a), 0.45 * std::sin(a), -0.1},
                    head + Vec3{0.05 * std::cos(a), 0.05 * std::sin(a), -0.12}, 0.018, 8, {Material::Wood, surface, 0});
  }
  scene.still.cylinder(head - Vec3{0, 0, 0.14}, 0.07, 0.05, 0.06, 12, {Material::Steel, surface, 0});
  scene.still.rod(head - Vec3{0, 0, 0.10}, head, 0.012, 8, {Material::Steel, surface, 0});
}

void add_decoy(Scene& scene, Vec3 foot, int kind, Draw& draw, std::uint16_t id) {
  Mesh& mesh = scene.still;
  switch (kind) {
    case 0:
      mesh.ellipsoid(foot + Vec3{0, 0, 1.2}, {0.11, 0.11, 0.11}, 32, 48, {Material::TargetWhite, id, 0});
      add_tripod(scene, foot, 1.09, id, draw(0, 2));
      break;
    case 1:
      mesh.ellipsoid(foot + Vec3{0, 0, 0.24}, {0.25, 0.25, 0.25}, 32, 48, {Material::TargetWhite, id, 0});
      break;
    case 2:
      mesh.ellipsoid(foot + Vec3{0, 0, 1.1}, {0.145, 0.145, 0.19}, 32, 48, {Material::TargetWhite, id, 0});
      add_tripod(scene, foot, 0.92, id, draw(0, 2));
      break;
    case 3:  // a marker post with a domed head
      mesh.cylinder(foot, 0.145, 0.145, 1.0, 24, {Material::TargetWhite, id, 0});
      mesh.ellipsoid(foot + Vec3{0, 0, 1.0}, {0.145, 0.145, 0.145}, 24, 36, {Material::TargetWhite, id, 0});
      break;
    case 4:
      mesh.cylinder(foot, 0.29, 0.29, 0.88, 32, {Material::CarPaint, id, draw.below(9)});
      break;
    default: {
      const Vec3 half_axes{draw(0.3, 0.8), draw(0.3, 0.7), draw(0.25, 0.6)};
      mesh.ellipsoid(foot + Vec3{0, 0, draw(0.05, 0.25)}, half_axes, 9, 14, {Material::Rock, id, 1});
    }
  }
}

}  // namespace

Scene build_targets(const Scenario& c, const CentreLine& line, double /*length*/) {
  Scene scene;
  const Vec3 centre = line.place(0, c.drive.lane_offset_m);
  add_pit(scene, centre);
  Draw draw{c.seed, kStreamScene + 49};
  // The golden angle spreads the things all around, so that they rarely stand behind each other.
  int index = 0;
  const auto next_place = [&](double nearest, double farthest) {
    const double a = 2.399963 * index++ + draw(-0.15, 0.15), r = draw(nearest, farthest);
    return centre + ground(r, a);
  };
  const auto add_target = [&](double radius, const std::string& name, double nearest, double farthest) {
    const Vec3 foot = next_place(nearest, farthest);
    const std::uint16_t id = add_surface(scene, name), legs = add_surface(scene, "tripod of " + name);
    const double up = draw(1.15, 1.75);
    const Vec3 middle = foot + Vec3{0, 0, up};
    scene.still.ellipsoid(middle, {radius, radius, radius}, 64, 96, {Material::TargetWhite, id, 0});
    add_tripod(scene, foot, up - radius, legs, draw(0, 2));
    scene.targets.push_back({id, middle, radius});
  };
  for (int i = 0; i < c.targets.large; ++i) add_target(kLargeRadius, "target large " + std::to_string(i), 5, 16);
  for (int i = 0; i < c.targets.small; ++i) add_target(kSmallRadius, "target small " + std::to_string(i), 3.8, 8);
  for (int i = 0; i < c.targets.decoys; ++i)
    add_decoy(scene, next_place(4, 15), i % 6, draw, add_surface(scene, "decoy " + std::to_string(i)));
  return scene;
}

}  // namespace hueline::sim
