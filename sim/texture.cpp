#include "sim/texture.hpp"

#include <algorithm>
#include <cmath>

namespace hueline::sim {
namespace {

std::uint32_t cell_bits(std::int32_t x, std::int32_t y, std::uint32_t seed) {
  std::uint32_t h =
      static_cast<std::uint32_t>(x) * 0x8DA6B343u ^ static_cast<std::uint32_t>(y) * 0xD8163841u ^ seed * 0xCB1AB31Fu;
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return h ^ (h >> 15);
}
/// Returns a random value in -1 .. 1 for each cell.
float cell_value(std::int32_t x, std::int32_t y, std::uint32_t seed) {
  return static_cast<float>(cell_bits(x, y, seed) >> 8) * (2.0f / 16777216.0f) - 1.0f;
}
std::int32_t whole(float x) { return static_cast<std::int32_t>(std::floor(x)); }

Albedo asphalt(const Scene& scene, const TextureSample& t) {
  const float w = std::max(t.width_u, t.width_v);
  // u runs along the street and v across it, so stains are stretched along the tracks of the wheels.
  float g = 0.105f + 0.018f * smooth_noise(t.u / 5.0f, t.v / 1.1f, w / 1.1f, 11) +
            0.014f * smooth_noise(t.u / 0.7f, t.v / 0.4f, w / 0.4f, 12) +
            0.02f * smooth_noise(t.u / 0.09f, t.v / 0.09f, w / 0.09f, 13);
  // Old trenches, filled with darker asphalt.
  if (cell_bits(whole(t.u / 23.0f), 0, 17) % 3 == 0) {
    const float x = t.u - 23.0f * std::floor(t.u / 23.0f);
    g *= 1 - 0.35f * covered(x, t.width_u, 6.0f, 9.5f) * covered(t.v, t.width_v, 0.6f, 2.4f);
  }
  Albedo a{g * 1.0f, g * 0.99f, g * 0.96f};
  const auto half = static_cast<float>(scene.road_half_width_m);
  const auto zebra = static_cast<float>(scene.zebra_at_m);
  float paint = covered_periodic(t.u, t.width_u, 9.0f, 0.0f, 3.0f) * covered(t.v, t.width_v, -0.07f, 0.07f);
  paint += covered(t.v, t.width_v, half - 0.40f, half - 0.26f) + covered(t.v, t.width_v, -half + 0.26f, -half + 0.40f);
  const float crossing = covered(t.u, t.width_u, zebra, zebra + 4.0f);
  paint = paint * (1 - covered(t.u, t.width_u, zebra - 1.5f, zebra + 5.5f)) +
          crossing * covered_periodic(t.v, t.width_v, 1.0f, 0.0f, 0.5f) *
              covered(t.v, t.width_v, -half + 0.3f, half - 0.3f);
  paint += covered(t.u, t.width_u, zebra - 1.4f, zebra - 1.0f) * covered(t.v, t.width_v, 0.2f, half - 0.5f);
  paint += covered(t.u, t.width_u, zebra + 5.0f, zebra + 5.4f) * covered(t.v, t.width_v, -half + 0.5f, -0.2f);
  const float wear = 0.85f + 0.15f * smooth_noise(t.u / 0.5f, t.v / 0.3f, w / 0.3f, 14);
  a = mixed(a, {0.62f, 0.62f, 0.59f}, std::min(1.0f, paint) * wear);
  // Manhole covers, and a hatched yellow box now and then, which are easy to recognise from above.
  const float mx = t.u - 31.0f * std::floor(t.u / 31.0f) - 12.0f, my = t.v - 1.0f;
  const float r = std::sqrt(mx * mx + my * my);
  a = mixed(a, {0.05f, 0.045f, 0.04f},
            covered(r, w, -0.36f, 0.36f) * (0.75f + 0.25f * covered_periodic(t.u + t.v, w, 0.12f, 0.0f, 0.06f)));
  const float bus = covered(t.u, t.width_u, zebra + 28.0f, zebra + 40.0f) * covered(t.v, t.width_v, 0.3f, half - 0.5f);
  if (bus > 0)
    a = mixed(a, {0.62f, 0.40f, 0.03f}, bus * covered_periodic(t.u + t.v * 1.5f, w * 1.3f, 2.0f, 0.0f, 0.22f));
  return a;
}

Albedo pavement(const TextureSample& t, float slab_u, float slab_v, Albedo base) {
  const float w = std::max(t.width_u, t.width_v);
  const float joint = std::max(covered_periodic(t.u, t.width_u, slab_u, 0.0f, 0.02f),
                               covered_periodic(t.v, t.width_v, slab_v, 0.0f, 0.02f));
  const float tint = 1 + 0.10f * tile_tint(t.u, t.v, slab_u, slab_v, w, 21) +
                     0.07f * smooth_noise(t.u / 1.9f, t.v / 1.9f, w / 1.9f, 22) +
                     0.05f * smooth_noise(t.u / 0.11f, t.v / 0.11f, w / 0.11f, 23);
  return scaled(base, tint * (1 - 0.5f * joint));
}

Albedo masonry(const TextureSample& t, const Albedo& wall, bool is_brick, std::uint32_t seed) {
  const float w = std::max(t.width_u, t.width_v);
  float tint = 1 + 0.06f * smooth_noise(t.u / 2.7f, t.v / 1.6f, w / 1.6f, seed) +
               0.04f * smooth_noise(t.u / 0.3f, t.v / 0.3f, w / 0.3f, seed + 1);
  // Rain makes the foot of a wall darker.
  tint *= 1 - 0.25f * std::exp(-std::max(0.0f, t.v) * 1.4f);
  if (!is_brick) return scaled(wall, tint);
  const float row = std::floor(t.v / 0.16f), shift = 0.17f * (row - 2 * std::floor(row / 2));
  tint += 0.16f * tile_tint(t.u + shift, t.v, 0.34f, 0.16f, w, seed + 2);
  const float joint = std::max(covered_periodic(t.u + shift, t.width_u, 0.34f, 0.0f, 0.018f),
                               covered_periodic(t.v, t.width_v, 0.16f, 0.0f, 0.018f));
  return mixed(scaled(wall, tint), {0.45f, 0.43f, 0.39f}, joint * 0.8f);
}

/// A pane with frame and glazing bars between (0, 0) and (width, height), drawn over `under`.
Albedo window(const Albedo& under, float u, float v, float wu, float wv, float width, float height, float bar,
              Albedo frame, Albedo glass) {
  const float outer = covered(u, wu, -bar, width + bar) * covered(v, wv, -bar, height + bar);
  if (outer <= 0) return under;
  float inner = covered(u, wu, 0.0f, width) * covered(v, wv, 0.0f, height);
  inner *= 1 - covered(u, wu, width / 2 - 0.03f, width / 2 + 0.03f);
  inner *= 1 - covered(v, wv, height * 0.66f, height * 0.66f + 0.05f);
  // Panes mirror the sky, so they are lighter at the top.
  const Albedo pane = scaled(glass, 0.7f + 0.6f * std::clamp(v / height, 0.0f, 1.0f));
  return mixed(under, mixed(frame, pane, outer > 0 ? std::min(1.0f, inner / outer) : 0.0f), outer);
}

Albedo facade(const FacadeStyle& f, const TextureSample& t) {
  Albedo a = masonry(t, f.wall, f.is_brick, f.seed);
  const auto width = static_cast<float>(f.width_m), height = static_cast<float>(f.height_m);
  constexpr float kGround = 3.95f;
  if (t.v > kGround - 0.2f) {
    const auto bay = static_cast<float>(f.bay_m), storey = static_cast<float>(f.storey_m);
    const std::int32_t i = whole(t.u / bay), j = whole((t.v - kGround) / storey);
    const float u = t.u - static_cast<float>(i) * bay - (bay - static_cast<float>(f.window_width_m)) / 2;
    const float v = t.v - kGround - static_cast<float>(j) * storey - 0.75f;
    if (j >= 0 && kGround + static_cast<float>(j + 1) * storey < height + 0.3f) {
      const float tint = 0.5f + 0.5f * cell_value(i, j, f.seed);
      a = window(a, u, v, t.width_u, t.width_v, static_cast<float>(f.window_width_m),
                 static_cast<float>(f.window_height_m), 0.10f, f.trim,
                 mixed({0.06f, 0.08f, 0.10f}, {0.20f, 0.19f, 0.16f}, tint));
    }
    return a;
  }
  // The ground floor has a plinth, a door, and a shop window with a sign above it or plain windows.
  a = mixed(a, scaled(f.trim, 0.45f), covered(t.v, t.width_v, -1.0f, 0.55f));
  const float door = width * 0.72f;
  a = window(a, t.u - door, t.v - 2.2f, t.width_u, t.width_v, 1.2f, 0.45f, 0.09f, f.trim, {0.07f, 0.08f, 0.09f});
  const float leaf = covered(t.u, t.width_u, door, door + 1.2f) * covered(t.v, t.width_v, 0.0f, 2.12f);
  const float panel = covered_periodic(t.u - door, t.width_u, 0.6f, 0.12f, 0.48f) *
                      covered_periodic(t.v, t.width_v, 1.0f, 0.15f, 0.85f);
  a = mixed(a, scaled(f.door, 1 - 0.35f * panel), leaf);
  if (f.has_shop) {
    const float x0 = 0.9f, w = width * 0.55f - 1.0f;
    a = window(
        a, t.u - x0, t.v - 0.65f, t.width_u, t.width_v, w, 1.9f, 0.08f, scaled(f.sign, 0.6f),
        mixed({0.10f, 0.11f, 0.12f}, f.door, 0.25f + 0.2f * smooth_noise(t.u * 1.3f, t.v * 1.3f, t.width_u, f.seed)));
    const float board = covered(t.u, t.width_u, 0.5f, width - 0.5f) * covered(t.v, t.width_v, 3.0f, 3.7f);
    // The lettering consists of blocks of two widths; no two signs are alike.
    const std::int32_t cell = whole((t.u - 0.9f) / 0.42f);
    const std::uint32_t bits = cell_bits(cell, 1, f.seed);
    const float x = t.u - 0.9f - 0.42f * static_cast<float>(cell), letters = (bits % 5 != 0) ? 1.0f : 0.0f;
    const float fade = std::clamp(1.5f - t.width_u / 0.3f, 0.0f, 1.0f);
    float ink = covered(x, t.width_u, 0.06f, 0.12f + 0.06f * static_cast<float>(bits >> 8 & 3)) *
                covered(t.v, t.width_v, 3.14f, 3.56f);
    ink += covered(x, t.width_u, 0.06f, 0.34f) * covered(t.v, t.width_v,
                                                         3.14f + 0.17f * static_cast<float>(bits >> 11 & 1),
                                                         3.24f + 0.17f * static_cast<float>(bits >> 11 & 1));
    const float span = covered(t.u, t.width_u, 0.9f, width * 0.75f);
    a = mixed(a, mixed(f.sign, {0.80f, 0.80f, 0.76f}, fade * letters * span * std::min(1.0f, ink)), board);
  } else {
    for (float x = 1.2f; x + 1.4f < door - 0.4f; x += 2.4f)
      a = window(a, t.u - x, t.v - 1.0f, t.width_u, t.width_v, 1.3f, 1.7f, 0.10f, f.trim, {0.09f, 0.10f, 0.12f});
  }
  return a;
}

Albedo sign_face(const Albedo& paint, const TextureSample& t) {
  // u, v are coordinates on the unit disc: a white rim, a coloured field and a white arrow.
  const float w = std::max(t.width_u, t.width_v), r = std::sqrt(t.u * t.u + t.v * t.v);
  Albedo a = mixed({0.75f, 0.75f, 0.75f}, paint, covered(r, w, -0.86f, 0.86f));
  const float shaft = covered(t.u, t.width_u, -0.12f, 0.12f) * covered(t.v, t.width_v, -0.55f, 0.3f);
  const float head = covered(std::fabs(t.u) + t.v, 1.4f * w, 0.0f, 0.6f) * covered(t.v, t.width_v, 0.15f, 0.6f);
  return mixed(a, {0.75f, 0.75f, 0.75f}, std::min(1.0f, shaft + head));
}

}  // namespace

float headlight_share(const TextureSample& t) {
  return covered(std::fabs(t.u), t.width_u, 0.48f, 0.78f) * covered(t.v, t.width_v, 0.22f, 0.36f);
}

float tile_tint(float u, float v, float du, float dv, float w, std::uint32_t seed) {
  const float fade = std::clamp(1.6f - 1.2f * w / std::min(du, dv), 0.0f, 1.0f);
  return fade > 0 ? fade * cell_value(whole(u / du), whole(v / dv), seed) : 0.0f;
}

float covered(float x, float w, float a, float b) {
  w = std::max(w, 1e-4f);
  return std::clamp((std::min(b, x + w / 2) - std::max(a, x - w / 2)) / w, 0.0f, 1.0f);
}

float covered_periodic(float x, float w, float period, float a, float b) {
  w = std::max(w, 1e-4f);
  const auto integral = [&](float t) {
    const float n = std::floor(t / period);
    return n * (b - a) + std::clamp(t - n * period - a, 0.0f, b - a);
  };
  // Compute near zero: differences of large numbers would lose the last digits of a float.
  const float base = period * std::floor(x / period);
  return (integral(x - base + w / 2) - integral(x - base - w / 2)) / w;
}

float smooth_noise(float x, float y, float footprint, std::uint32_t seed) {
  const float fade = std::clamp(1.5f - footprint, 0.0f, 1.0f);
  if (fade <= 0) return 0;
  const std::int32_t i = whole(x), j = whole(y);
  float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
  fx = fx * fx * (3 - 2 * fx);
  fy = fy * fy * (3 - 2 * fy);
  const float a = cell_value(i, j, seed), b = cell_value(i + 1, j, seed), c = cell_value(i, j + 1, seed),
              d = cell_value(i + 1, j + 1, seed);
  return fade * (a + (b - a) * fx + (c - a) * fy + (a - b - c + d) * fx * fy);
}

Albedo albedo_at(const Scene& scene, const TextureSample& t) {
  const float w = std::max(t.width_u, t.width_v);
  switch (t.tag.material) {
    case Material::Asphalt:
      return asphalt(scene, t);
    case Material::Pavement:
      return pavement(t, 0.5f, 0.5f, {0.36f, 0.34f, 0.31f});
    case Material::Kerb:
      return pavement(t, 1.0f, 10.0f, {0.42f, 0.42f, 0.40f});
    case Material::Grass: {
      const float n = smooth_noise(t.u / 1.3f, t.v / 1.3f, w / 1.3f, 31) +
                      0.7f * smooth_noise(t.u / 0.15f, t.v / 0.15f, w / 0.15f, 32);
      return {0.10f + 0.03f * n, 0.19f + 0.04f * n, 0.05f + 0.01f * n};
    }
    case Material::Facade:
      return facade(scene.facades[t.tag.style], t);
    case Material::SideWall:
      return masonry(t, scene.facades[t.tag.style].wall, scene.facades[t.tag.style].is_brick,
                     scene.facades[t.tag.style].seed);
    case Material::Roof:
      return {0.24f, 0.10f, 0.07f};
    case Material::Stone:
      return scaled(scene.facades[t.tag.style].trim,
                    0.85f + 0.08f * smooth_noise(t.u / 0.4f, t.v / 0.4f, w / 0.4f, 41));
    case Material::Brick:
      return masonry(t, {0.42f, 0.18f, 0.12f}, true, 51);
    case Material::Awning:
      return mixed(scene.facades[t.tag.style].sign, {0.78f, 0.77f, 0.72f},
                   covered_periodic(t.u, t.width_u, 0.6f, 0.0f, 0.3f));
    case Material::Bark:
      return scaled({0.16f, 0.11f, 0.07f}, 1 + 0.35f * smooth_noise(t.u / 0.05f, t.v / 0.35f, w / 0.05f, 61));
    case Material::Leaf: {
      const float n = static_cast<float>(t.tag.style & 0xFF) / 255.0f,
                  m = static_cast<float>(t.tag.style >> 8 & 0xFF) / 255.0f;
      return {0.07f + 0.09f * n, 0.20f + 0.13f * m, 0.03f + 0.03f * n};
    }
    case Material::Steel:
      return {0.26f, 0.28f, 0.28f};
    case Material::SignFace:
      return sign_face(scene.paints[t.tag.style], t);
    case Material::CarPaint: {
      // Seams of the doors and a line of handles; side walls have y and z as texture coordinates.
      const float seam = covered(t.u, t.width_u, -0.21f, -0.19f) + covered(t.u, t.width_u, 0.78f, 0.80f) +
                         covered(t.u, t.width_u, -1.02f, -1.0f);
      return scaled(scene.paints[t.tag.style], 1 - 0.6f * std::min(1.0f, seam) * covered(t.v, t.width_v, 0.3f, 0.9f));
    }
    case Material::CarGlass:
      return {0.035f, 0.045f, 0.055f};
    case Material::CarEnd: {
      const float lamp = headlight_share(t);
      const float plate = covered(t.u, t.width_u, -0.26f, 0.26f) * covered(t.v, t.width_v, 0.05f, 0.16f);
      return mixed(mixed(scaled(scene.paints[t.tag.style], 0.8f), {0.80f, 0.60f, 0.55f}, lamp), {0.75f, 0.75f, 0.70f},
                   plate);
    }
    case Material::Tyre: {
      const float r = std::sqrt(t.u * t.u + t.v * t.v);
      return mixed({0.025f, 0.025f, 0.025f}, {0.40f, 0.41f, 0.42f}, covered(r, w, -0.62f, 0.62f));
    }
    default:
      return scene_albedo_at(scene, t);
  }
}

}  // namespace hueline::sim
