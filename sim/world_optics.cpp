#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/noise.hpp"
#include "sim/radiance.hpp"
#include "sim/texture.hpp"
#include "sim/world_contact.hpp"

/// Panes, fences and wires, which a ray meets before the first solid thing, and water on the ground.
namespace hueline::sim {
namespace {

constexpr int kMostLayers = 256;

/// Returns the share of unpolarised light that a smooth surface of index n reflects (Fresnel).
double fresnel(double cosine, double n) {
  const double c = std::clamp(cosine, 0.0, 1.0), g = std::sqrt(n * n - 1 + c * c);
  const double across = (c - g) / (c + g), along = (n * n * c - g) / (n * n * c + g);
  return 0.5 * (across * across + along * along);
}

/// Where a ray is nearest to the axis of a wire.
struct Approach {
  double distance_m = 0;  ///< along the ray, of the wire's surface, or of the nearest place if the ray passes the wire
  double off_m = 0;       ///< from the axis
  Vec3 normal;            ///< of the wire where it faces the ray
};

std::optional<Approach> approach(const World::Ray& ray, const Wire& wire) {
  const Vec3 axis = normalised(wire.to - wire.from), between = ray.origin - wire.from;
  const double b = dot(ray.direction, axis), across2 = 1 - b * b;
  if (across2 < 1e-6) return {};  // along the wire
  const double d = dot(between, ray.direction), e = dot(between, axis), t = (b * e - d) / across2;
  const Vec3 off = between + t * ray.direction - (e + b * t) * axis;
  Approach out;
  out.off_m = length(off);
  const double r = wire.radius_m;
  out.distance_m = t - (out.off_m < r ? std::sqrt((r * r - out.off_m * out.off_m) / across2) : 0.0);
  out.normal = (-1 / std::sqrt(across2)) * (ray.direction - b * axis);
  return out;
}

/// Returns the share of a footprint that a fence covers.
float share_of_openwork(std::uint32_t style, float u, float v, float width_u, float width_v) {
  if (style == 0) {
    const float bars = covered_periodic(u, width_u, 0.12f, 0.0f, 0.02f);
    const float rails = covered(v, width_v, 0.08f, 0.12f) + covered(v, width_v, 1.05f, 1.10f);
    return 1 - (1 - bars) * (1 - rails);
  }
  // Two families of wires that run at 45 degrees to the ground.
  constexpr float kMesh = 0.05f, kWire = 0.004f, kTurn = 0.70710678f;
  const float p = kTurn * (u + v), q = kTurn * (u - v), width = std::max(width_u, width_v);
  return 1 -
         (1 - covered_periodic(p, width, kMesh, 0.0f, kWire)) * (1 - covered_periodic(q, width, kMesh, 0.0f, kWire));
}

}  // namespace

Seen World::mirrored(const Moment& at, const Ray& ray, double distance_m, Vec3 normal, float cone) const {
  const Vec3 away = ray.direction - 2 * dot(ray.direction, normal) * normal;
  // The ray begins at the mirror image of its origin, so that its footprints grow from there.
  const Ray image{ray.origin + distance_m * ray.direction - distance_m * away, away, distance_m + 2e-3, ray.far_m};
  Seen seen;
  look_at_solids(at, {&image, 1}, cone, {&seen, 1});
  return seen;
}

bool soaks(Material material) {
  switch (material) {
    case Material::Asphalt:
    case Material::Pavement:
    case Material::Kerb:
    case Material::Plaza:
    case Material::Cobble:
      return true;
    default:
      return false;
  }
}

void World::add_water(const Moment& at, const Ray& ray, float cone, Seen& seen) const {
  if (!seen.is_hit || seen.surface == 1 || seen.normal.z < kLevel || !soaks(seen.material)) return;
  const Vec3 place = ray.origin + seen.distance_m * ray.direction;
  const auto x = static_cast<float>(place.x), y = static_cast<float>(place.y);
  const float footprint = cone * static_cast<float>(seen.distance_m);
  const auto wet = static_cast<float>(config_.wetness);
  const float relief = smooth_noise(x / 2.6f, y / 2.6f, footprint / 2.6f, 221) +
                       0.5f * smooth_noise(x / 0.9f, y / 0.9f, footprint / 0.9f, 222);
  const float puddle = std::clamp(6 * (relief - 1 + 1.3f * wet), 0.0f, 1.0f);
  // Between puddles the grains of the ground bend the thin film.
  constexpr float kBent = 0.02f;
  const float rough = (1 - puddle) * kBent;
  const Vec3 tilt{rough * smooth_noise(x / 0.12f, y / 0.12f, 0, 223),
                  rough * smooth_noise(x / 0.12f, y / 0.12f, 0, 224), 0};
  const Vec3 normal = normalised(seen.normal + tilt);
  const double cosine = -dot(ray.direction, normal);
  if (cosine <= 0) return;
  const float share =
      static_cast<float>(fresnel(cosine, 1.33)) * (puddle + (1 - puddle) * 0.4f * std::min(1.0f, 2 * wet));
  const Seen image = mirrored(at, ray, seen.distance_m, normal, cone);
  seen.colour = {};
  add_light(seen.colour, 1 - share, seen.own);
  add_light(seen.colour, share, image.colour);
  seen.transmitted *= 1 - share;
  // An outline in the mirror is an outline of the picture.
  if (share > 0.02f) seen.face ^= static_cast<std::uint32_t>(scrambled(image.is_hit ? image.face + 1 : 0) >> 40);
}

void World::look_through(const Moment& at, const Ray& ray, float cone, Seen& seen) const {
  const double end = seen.is_hit ? seen.distance_m : ray.far_m;
  double from = ray.near_m;
  float open = 1;   // share of the cone's light from farther away that arrives
  float glass = 1;  // share that panes let pass
  Radiance sum;
  std::optional<Seen> met;  // the wire or bar on which the middle of the ray falls
  for (int layer = 0; layer < kMostLayers; ++layer) {
    RTCRayHit hit{};
    hit.ray = {static_cast<float>(ray.origin.x),
               static_cast<float>(ray.origin.y),
               static_cast<float>(ray.origin.z),
               static_cast<float>(from),
               static_cast<float>(ray.direction.x),
               static_cast<float>(ray.direction.y),
               static_cast<float>(ray.direction.z),
               0.0f,
               static_cast<float>(end),
               0xFFFFFFFFu,
               0,
               0};
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(embree_->sheer, &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
    from = hit.ray.tfar + 1e-4;

    Seen one;
    Contact contact;
    contact.set_hit(scene_.sheer, hit.hit.primID, hit.hit.u, hit.hit.v, hit.ray.tfar, one);
    one.face += 0x20000000u;
    const bool is_from_behind = dot(one.normal, ray.direction) > 0;
    if (is_from_behind) one.normal = -1.0 * one.normal;
    if (one.material == Material::Pane) {
      const double once = fresnel(-dot(one.normal, ray.direction), glass_.refractive_index);
      const auto both = static_cast<float>(2 * once / (1 + once));  // of both surfaces, with what goes to and fro
      add_light(sum, open * both, mirrored(at, ray, one.distance_m, one.normal, cone).colour);
      const float passes = (1 - both) * static_cast<float>(glass_.transmittance);
      open *= passes;
      if (!met) glass *= passes;
      continue;
    }
    float share = 0;
    bool is_met = false;
    if (one.material == Material::Wire) {
      if (is_from_behind) continue;  // the ray leaves the sheath
      const Wire& wire = scene_.wires[contact.face->tag.style];
      const auto near = approach(ray, wire);
      if (!near || near->distance_m <= ray.near_m || near->distance_m >= end) continue;
      one.distance_m = near->distance_m;
      one.normal = near->normal;
      const auto off = static_cast<float>(near->off_m), radius = static_cast<float>(wire.radius_m);
      share = covered(off, cone * static_cast<float>(near->distance_m), -radius, radius);
      is_met = off < radius;
    } else {
      const TextureSample t = sample(ray, one, contact, cone);
      share = share_of_openwork(t.tag.style, t.u, t.v, t.width_u, t.width_v);
      is_met = share_of_openwork(t.tag.style, t.u, t.v, 0, 0) > 0.5f;
    }
    if (share <= 0 && !is_met) continue;
    find_shadows(at, {&ray, 1}, {&one, 1}, {&contact, 1});
    one.own = with_lamps(at, ray, one, contact, cone, shade(ray, one, contact, cone));
    add_light(sum, open * share, one.own);
    open *= 1 - share;
    if (is_met && !met) {
      one.transmitted = glass;
      met = one;
    }
  }
  add_light(sum, open, seen.colour);
  if (met) seen = *met;
  if (!met) seen.transmitted *= glass;
  seen.colour = sum;
}

}  // namespace hueline::sim
