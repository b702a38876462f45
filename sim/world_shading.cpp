#include <algorithm>
#include <cmath>

#include "sim/texture.hpp"
#include "sim/world_contact.hpp"

namespace hueline::sim {

Radiance World::sky(Vec3 d, float cone) const {
  const auto bright = static_cast<float>(config_.sky_brightness * config_.daylight);
  if (surroundings_) {
    const Radiance c = surroundings_->at(d, cone);
    return {bright * c.r, bright * c.g, bright * c.b};
  }
  const auto up = static_cast<float>(std::max(0.0, d.z));
  const float haze = std::exp(-5.0f * up);
  Radiance c{0.22f + 0.50f * haze, 0.42f + 0.36f * haze, 0.80f + 0.05f * haze};
  if (d.z > 0.03) {
    const auto x = static_cast<float>(d.x / d.z), y = static_cast<float>(d.y / d.z);
    float n = smooth_noise(x * 0.9f + 7, y * 0.9f, 0, 71) + 0.5f * smooth_noise(x * 2.1f, y * 2.1f, 0, 72) +
              0.25f * smooth_noise(x * 4.7f, y * 4.7f, 0.3f, 73);
    n = std::clamp(0.9f * n - 0.15f, 0.0f, 1.0f) * std::min(1.0f, 6.0f * up);
    c = {c.r + (0.92f - c.r) * n, c.g + (0.92f - c.g) * n, c.b + (0.94f - c.b) * n};
  }
  const auto glow = static_cast<float>(std::max(0.0, dot(d, to_sun_)));
  const float g8 = glow * glow * glow * glow * glow * glow * glow * glow, disc = glow > 0.99996f ? 4.0f : 0.0f;
  const float halo = 0.25f * g8 * g8 * g8 + disc;
  return {bright * (c.r + halo), bright * (c.g + 0.93f * halo), bright * (c.b + 0.8f * halo)};
}

float World::daylight(Vec3 place) const {
  const Enclosure& in = scene_.enclosure;
  if (!in.is_there) return 1.0f;
  const Vec3 from = place - in.from;
  const double along = dot(from, in.along), inwards = std::min(along, in.length_m - along);
  if (inwards <= 0 || std::abs(dot(from, in.right)) > in.half_width_m || from.z > in.height_m || from.z < -0.05)
    return 1.0f;
  // The sky is visible only through the nearer end, so its share falls with the square of the distance.
  const double reach = inwards / (0.8 * in.height_m);
  return static_cast<float>(0.6 / (1 + reach * reach * 2));
}

float World::lamplight(Vec3 place, Vec3 normal) const {
  float sum = 0;
  for (const LightSource& lamp : scene_.lamps) {
    const Vec3 to = lamp.place - place;
    const double d2 = dot(to, to);
    if (d2 > 400) continue;
    const double d = std::sqrt(d2), down = to.z / d, facing = dot(to, normal) / d;
    if (down > 0 && facing > 0) sum += lamp.power * static_cast<float>(down * facing / (0.25 + d2));
    // Light that walls and road reflect reaches every side.
    sum += 0.06f * lamp.power / static_cast<float>(1 + 0.1 * d2);
  }
  return sum;
}

TextureSample World::sample(const Ray& ray, const Seen& s, const Contact& c, float cone) {
  // The cone meets the surface in an ellipse. Along a texture axis t it is stretched to sqrt(1 + (t.d)^2 / (n.d)^2).
  const double slant = std::max(1e-3, std::abs(dot(s.normal, ray.direction)));
  const auto width = [&](Vec3 grad) {
    const double steep = length(grad), along = steep > 0 ? dot(grad, ray.direction) / steep : 0.0;
    return static_cast<float>(cone * s.distance_m * steep * std::sqrt(1 + along * along / (slant * slant)));
  };
  return {c.face->tag, c.u, c.v, width(c.grad_u), width(c.grad_v)};
}

Radiance World::shade(const Ray& ray, Seen& s, const Contact& c, float cone) const {
  if (!s.is_hit) return sky(ray.direction, cone);
  Albedo a;
  if (c.own_part >= 0) {
    a = c.own_part < 2 || c.own_part == 7 ? Albedo{.72f, .72f, .70f} : Albedo{.05f, .05f, .05f};
  } else {
    a = albedo_at(scene_, sample(ray, s, c, cone));
  }
  if (config_.wetness > 0 && s.normal.z > kLevel && soaks(s.material)) {
    const auto dark = static_cast<float>(1 - 0.45 * config_.wetness);
    a = {dark * a.r, dark * a.g, dark * a.b};
  }
  s.reflectance = (a.r + a.g + a.b) / 3;
  s.albedo = a;
  const bool leaf = s.material == Material::Leaf;
  double facing = dot(s.normal, to_sun_);
  // Leaves let light through and are lit from both sides.
  if (leaf) facing = 0.35 + 0.5 * std::abs(facing);
  const float sun = c.in_sun ? static_cast<float>(std::max(0.0, facing)) : 0.0f;
  const auto up = static_cast<float>(0.5 + 0.5 * s.normal.z);
  Radiance out{a.r * (sun * 1.02f + 0.25f * up + 0.13f * (1 - up)), a.g * (sun * 0.96f + 0.29f * up + 0.12f * (1 - up)),
               a.b * (sun * 0.86f + 0.37f * up + 0.11f * (1 - up))};
  const auto day = static_cast<float>(config_.daylight);
  if (day < 1) out = {day * out.r, day * out.g, day * out.b};
  if (scene_.enclosure.is_there) {
    const Vec3 place = ray.origin + s.distance_m * ray.direction;
    if (const float share = daylight(place); share < 1) {
      const float lamps = lamplight(place, s.normal);
      out = {share * out.r + a.r * lamps, share * out.g + 0.88f * a.g * lamps, share * out.b + 0.70f * a.b * lamps};
      if (s.material == Material::LampGlass) return {5.0f, 4.4f, 3.5f};
      return out;
    }
  }
  if (s.material == Material::CarGlass || s.material == Material::CarPaint) {
    const Vec3 mirrored = ray.direction - 2 * dot(ray.direction, s.normal) * s.normal;
    const float share = s.material == Material::CarGlass ? 0.22f : 0.05f;
    const Radiance m = mirrored.z > 0 ? sky(mirrored, cone) : Radiance{0.15f * day, 0.15f * day, 0.15f * day};
    out = {out.r + share * m.r, out.g + share * m.g, out.b + share * m.b};
  }
  return out;
}

}  // namespace hueline::sim
