#include <algorithm>
#include <cmath>

#include "sim/own_vehicle.hpp"
#include "sim/radiance.hpp"
#include "sim/texture.hpp"
#include "sim/world_contact.hpp"

/// Lamps at night: what they light, and how they look.
namespace hueline::sim {
namespace {

constexpr double kReach = 70;        // m; beyond it a lamp lights nothing
constexpr float kDarkest = 2e-5f;    // weaker light of one lamp is left out
constexpr float kLampLuminance = 5;  // of the glass of a street lamp, for its light at 1 m: it has 0.16 m^2
constexpr float kHeadlightLuminance = 2;

/// Returns the share of its light that a dipped headlight sends in a direction of its carrier's frame.
double dipped(Vec3 direction) {
  if (direction.y <= 0) return 0;
  const double aside = std::atan2(direction.x, direction.y) / 0.36;
  const double up = std::atan2(direction.z, std::hypot(direction.x, direction.y));
  const double below = (up + 0.03) / 0.10;
  return std::exp(-0.5 * aside * aside) * (up > -0.012 ? 0.03 : std::exp(-0.5 * below * below));
}

Vec3 place_of(const Moment& at, const NightLamp& lamp) {
  if (lamp.carrier == NightLamp::kStill) return lamp.place;
  if (lamp.carrier == NightLamp::kOwnVehicle) return at.T_enu_body * lamp.place;
  return at.T_enu_mover[static_cast<std::size_t>(lamp.carrier)] * lamp.place;
}

/// Returns the rotation into the frame of the vehicle that carries a headlight.
const Mat3& turn_of(const Moment& at, const NightLamp& lamp) {
  return lamp.carrier == NightLamp::kOwnVehicle ? at.T_body_enu.R
                                                : at.T_mover_enu[static_cast<std::size_t>(lamp.carrier)].R;
}

}  // namespace

bool World::is_lit_by(const Moment& at, const NightLamp& lamp, Vec3 place, Vec3 to, double distance_m) const {
  RTCRay ray;
  set(ray, place, to, 0.004f, static_cast<float>(distance_m - 0.01));
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(embree_->still, &context, &ray);
  if (ray.tfar < 0) return false;
  for (std::size_t k = 0; k < at.T_enu_mover.size(); ++k) {
    const std::size_t shape = scene_.movers[k].shape;
    if (static_cast<int>(k) == lamp.carrier || !passes(scene_.shapes[shape], at.T_enu_mover[k], place, to)) continue;
    set(ray, at.T_mover_enu[k] * place, at.T_mover_enu[k].R * to, 0.004f, static_cast<float>(distance_m - 0.01));
    RTCIntersectContext alone;
    rtcInitIntersectContext(&alone);
    rtcOccluded1(embree_->shapes[shape], &alone, &ray);
    if (ray.tfar < 0) return false;
  }
  if (lamp.carrier == NightLamp::kOwnVehicle) return true;
  const auto own = own_vehicle_on_ray(at.T_body_enu * place, at.T_body_enu.R * to);
  return !own || own->distance_m > distance_m;
}

Radiance World::with_lamps(const Moment& at, const Ray& ray, const Seen& s, const Contact& contact, float cone,
                           Radiance by_day) const {
  if (!s.is_hit) return by_day;
  if (s.material == Material::LampGlass && config_.lamp_light > 0) {
    const float bright = kLampLuminance * static_cast<float>(config_.lamp_light);
    return {bright, 0.80f * bright, 0.52f * bright};
  }
  Radiance light;
  const Vec3 place = ray.origin + s.distance_m * ray.direction + kShadowBias * s.normal;
  for (const NightLamp& lamp : scene_.night_lamps) {
    const Vec3 between = place_of(at, lamp) - place;
    const double d2 = dot(between, between);
    if (d2 > kReach * kReach) continue;
    const double d = std::sqrt(d2);
    const Vec3 to = (1 / d) * between;
    // Light that the street reflects reaches every side of what is near a lamp.
    if (!lamp.is_headlight) add_light(light, 0.012f / static_cast<float>(1 + 0.1 * d2), lamp.power);
    double facing = dot(to, s.normal);
    if (s.material == Material::Leaf) facing = 0.35 + 0.5 * std::abs(facing);  // as in the sun
    if (facing <= 0 || facing * lamp.power.r < kDarkest * d2) continue;
    const double spread = lamp.is_headlight ? dipped(-1.0 * (turn_of(at, lamp) * to)) : std::max(0.0, to.z);
    const auto share = static_cast<float>(spread * facing / (0.25 + d2));
    if (share * lamp.power.r < kDarkest || !is_lit_by(at, lamp, place, to, d)) continue;
    add_light(light, share, lamp.power);
  }
  Radiance out{by_day.r + s.albedo.r * light.r, by_day.g + s.albedo.g * light.g, by_day.b + s.albedo.b * light.b};
  if (s.material == Material::CarEnd && contact.mover >= 0 && config_.car_lights > 0) {
    const TextureSample t = sample(ray, s, contact, cone);
    const float glass = headlight_share(t);
    const bool is_front = dot(s.normal, at.T_enu_mover[static_cast<std::size_t>(contact.mover)].R * Vec3{0, 1, 0}) > 0;
    const float bright = glass * kHeadlightLuminance * 100 * static_cast<float>(config_.car_lights);
    add_light(out, is_front ? 1.0f : 0.05f,
              is_front ? Radiance{bright, bright, 0.9f * bright} : Radiance{bright, 0.06f * bright, 0.04f * bright});
  }
  return out;
}

}  // namespace hueline::sim
