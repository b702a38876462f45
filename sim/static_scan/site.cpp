#include "sim/static_scan/site.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/noise.hpp"

namespace hueline::sim {
namespace {

/// Random numbers one after the other. A site is built in one fixed order, so that it is reproducible.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : draw_{seed, kStreamScene} {}
  double even(double from, double to) { return draw_(from, to); }
  double normal() { return gaussian(draw_.seed, kStreamRange, draw_.index++); }

 private:
  Draw draw_;
};

Vec3 shifted(Vec3 p, Dice& dice, double sigma) {
  const double x = dice.normal(), y = dice.normal(), z = dice.normal();
  return p + sigma * Vec3{x, y, z};
}

double azimuth_of(double x, double y) { return std::atan2(y, x); }
double turn_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * kPi)); }

/// Returns a place `distance` from the scanner and `stand` above the ground.
Vec3 on_stand(const StaticSite& site, double azimuth, double distance, double stand) {
  double across = distance;
  Vec3 p;
  for (int i = 0; i < 40; ++i) {
    p = {across * std::cos(azimuth), across * std::sin(azimuth), 0};
    p.z = site.ground(p.x, p.y) + stand;
    across = std::sqrt(std::max(1.0, distance * distance - p.z * p.z));
  }
  return p;
}

/// Returns whether the ground hides nothing of a ball.
bool is_above_ground(const StaticSite& site, const StaticSphere& sphere) {
  for (double share = 0.01; share < 0.995; share += 0.005) {
    const Vec3 p = share * sphere.centre;
    if (site.ground(p.x, p.y) > p.z - 2 * sphere.radius * share - 0.05) return false;
  }
  return true;
}

/// Returns whether something upright of this half width at (x, y) would stand in front of a ball.
bool would_hide(const StaticSite& site, double x, double y, double half_width) {
  const double distance = std::hypot(x, y);
  for (const StaticSphere& sphere : site.spheres) {
    const double across = std::hypot(sphere.centre.x, sphere.centre.y);
    if (across < distance - half_width - 1) continue;
    if (turn_between(azimuth_of(x, y), azimuth_of(sphere.centre.x, sphere.centre.y)) < (half_width + 0.6) / distance)
      return true;
  }
  return false;
}

bool add_sphere(StaticSite& site, const std::string& name, SphereKind kind, double azimuth, double distance,
                Dice& dice) {
  StaticSphere sphere;
  sphere.name = name;
  sphere.kind = kind;
  sphere.radius = site.config.radius_m;
  sphere.stand_height = dice.even(1.2, 2.2);
  sphere.centre = on_stand(site, azimuth, distance, sphere.stand_height + sphere.radius);
  sphere.common_range_error = site.config.common_range_sigma_m * dice.normal();
  if (!is_above_ground(site, sphere)) return false;
  for (const StaticSphere& other : site.spheres)
    if (length(other.centre - sphere.centre) < 1.2 ||
        turn_between(azimuth_of(other.centre.x, other.centre.y), azimuth) * distance < 6 * sphere.radius)
      return false;
  site.spheres.push_back(sphere);
  return true;
}

/// Places targets around the scanner, no two in nearly the same direction, and then decoys at the same distances, the
/// first of them close to a target.
void place_spheres(StaticSite& site, Dice& dice) {
  const StaticSiteConfig& config = site.config;
  const int targets = config.orientation_targets + config.check_targets;
  for (int i = 0; i < targets;) {
    const double azimuth = dice.even(-kPi, kPi), distance = dice.even(config.nearest_m, config.farthest_m);
    const bool is_crowded = std::ranges::any_of(site.spheres, [&](const StaticSphere& s) {
      return turn_between(azimuth_of(s.centre.x, s.centre.y), azimuth) < radians(25);
    });
    const bool is_check = i >= config.orientation_targets;
    if (is_crowded || !add_sphere(site,
                                  fmt::format("{}-{}{}", site.name, is_check ? "C" : "T",
                                              is_check ? i - config.orientation_targets + 1 : i + 1),
                                  is_check ? SphereKind::Check : SphereKind::Orientation, azimuth, distance, dice))
      continue;
    ++i;
  }
  const int decoys = static_cast<int>(std::ceil(config.decoy_share / (1 - config.decoy_share) * targets));
  for (int i = 0; i < decoys;) {
    const StaticSphere& beside = site.spheres[static_cast<std::size_t>(i % targets)];
    const double distance = length(beside.centre) + dice.even(-0.03, 0.03);
    const double there = azimuth_of(beside.centre.x, beside.centre.y);
    const double azimuth = i == 0 ? there + dice.even(1.5, 5) / distance : dice.even(-kPi, kPi);
    if (add_sphere(site, fmt::format("{}-D{}", site.name, i + 1), SphereKind::Decoy, azimuth, distance, dice)) ++i;
  }
}

/// Places trees, walls and bushes. Every third one stands at the distance of a sphere, where it matters most.
void place_clutter(StaticSite& site, Dice& dice) {
  const auto some_distance = [&](int i) {
    return i % 3 == 0
               ? length(site.spheres[static_cast<std::size_t>(i) % site.spheres.size()].centre) + dice.even(-0.15, 0.15)
               : dice.even(12, 320);
  };
  for (int i = 0; i < 70; ++i) {
    const double azimuth = dice.even(-kPi, kPi), distance = some_distance(i);
    // Some trunks are as thick as the targets.
    const double trunk = i % 4 == 0 ? site.config.radius_m : dice.even(0.05, 0.35), crown = dice.even(0.8, 3.5);
    const Vec3 foot = on_stand(site, azimuth, distance, 0);
    const double top = foot.z + dice.even(3, 9);
    if (would_hide(site, foot.x, foot.y, crown)) continue;
    site.poles.push_back({foot.x, foot.y, trunk, foot.z - 0.5, top});
    site.crowns.push_back({{foot.x, foot.y, top}, crown, dice.even(0.5, 3)});
  }
  for (int i = 0; i < 120; ++i) {
    const double azimuth = dice.even(-kPi, kPi), radius = dice.even(0.15, 0.9);
    const Vec3 foot = on_stand(site, azimuth, some_distance(3 * i), dice.even(0, 0.3));
    if (!would_hide(site, foot.x, foot.y, radius)) site.crowns.push_back({foot, radius, dice.even(2, 20)});
  }
  for (int i = 0; i < 14; ++i) {
    const double azimuth = dice.even(-kPi, kPi), facing = dice.even(0, 2 * kPi), half = dice.even(2, 14);
    const Vec3 middle = on_stand(site, azimuth, some_distance(i), 0);
    const double ux = half * std::cos(facing), uy = half * std::sin(facing);
    if (would_hide(site, middle.x, middle.y, half)) continue;
    site.walls.push_back(
        {middle.x - ux, middle.y - uy, middle.x + ux, middle.y + uy, middle.z - 3, middle.z + dice.even(2, 8)});
  }
}

}  // namespace

double StaticSite::ground(double x, double y) const {
  const double s = std::hypot(x, y), phase = 1.7 * config.station + 0.3 * static_cast<double>(config.seed % 1000);
  const double near = std::min(1.0, s / 40);
  const double wall = std::clamp((s - 90) / 260, 0.0, 1.0);
  return -1.7 +
         near * (2.2 * std::sin(x / 37 + phase) * std::sin(y / 43 - phase) -
                 6 * std::min(1.0, s / 90) * std::cos(std::atan2(y, x) + phase)) +
         60 * wall * wall * (3 - 2 * wall) * (0.75 + 0.25 * std::sin(2 * std::atan2(y, x) + phase));
}

StaticSite make_static_site(const StaticSiteConfig& config) {
  StaticSite site;
  site.config = config;
  site.name = fmt::format("S{:02}", config.station + 1);
  Dice dice(config.seed * 1000003 + static_cast<std::uint64_t>(config.station));
  // The survey area is 3.2 km x 2.8 km in a projected system, like the mine of the paper.
  site.place_survey = {512'000 + dice.even(0, 3200), 4'398'000 + dice.even(0, 2800), 1180 + dice.even(0, 120)};
  site.surveyed_place = shifted(site.place_survey, dice, config.station_sigma_m);
  const double heading = dice.even(-kPi, kPi);
  site.R_site_scanner = rotation_zyx(radians(dice.even(-3, 3)), radians(dice.even(-3, 3)), heading);
  place_spheres(site, dice);
  place_clutter(site, dice);
  for (const StaticSphere& sphere : site.spheres)
    site.surveyed.push_back(shifted(site.place_survey + sphere.centre, dice, config.survey_sigma_m));
  return site;
}

}  // namespace hueline::sim
