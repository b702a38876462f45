#include <algorithm>
#include <array>
#include <cmath>

#include "sim/texture.hpp"

namespace hueline::sim {
namespace {

/// Slabs of 1 m in two colours, worn and stained; every eighth row is a dark band.
Albedo plaza(const TextureSample& t) {
  const float w = std::max(t.width_u, t.width_v);
  const float joint = std::max(covered_periodic(t.u, t.width_u, 1.0f, 0.0f, 0.015f),
                               covered_periodic(t.v, t.width_v, 1.0f, 0.0f, 0.015f));
  const float check = covered_periodic(t.u, t.width_u, 2.0f, 0.0f, 1.0f),
              other = covered_periodic(t.v, t.width_v, 2.0f, 0.0f, 1.0f);
  Albedo a = mixed({0.46f, 0.40f, 0.32f}, {0.34f, 0.33f, 0.32f}, check * other + (1 - check) * (1 - other));
  const float band =
      std::max(covered_periodic(t.u, t.width_u, 8.0f, 0.0f, 0.5f), covered_periodic(t.v, t.width_v, 8.0f, 0.0f, 0.5f));
  a = mixed(a, {0.20f, 0.10f, 0.08f}, 0.85f * band);
  const float tint = 1 + 0.12f * tile_tint(t.u, t.v, 1.0f, 1.0f, w, 121) +
                     0.08f * smooth_noise(t.u / 2.3f, t.v / 2.3f, w / 2.3f, 122) +
                     0.06f * smooth_noise(t.u / 0.13f, t.v / 0.13f, w / 0.13f, 123);
  return scaled(a, tint * (1 - 0.5f * joint));
}

/// Rows of stones across the alley, each with its own grey, and a gutter of flat stones in the middle.
Albedo cobble(const TextureSample& t) {
  const float w = std::max(t.width_u, t.width_v), row = std::floor(t.u / 0.14f),
              shift = 0.09f * (row - 2 * std::floor(row / 2));
  const float joint = std::max(covered_periodic(t.u, t.width_u, 0.14f, 0.0f, 0.02f),
                               covered_periodic(t.v + shift, t.width_v, 0.18f, 0.0f, 0.02f));
  const float tint = 1 + 0.28f * tile_tint(t.u, t.v + shift, 0.14f, 0.18f, w, 131) +
                     0.18f * smooth_noise(t.u / 1.7f, t.v / 0.9f, w / 0.9f, 132);
  return mixed(scaled({0.25f, 0.235f, 0.22f}, tint), {0.09f, 0.085f, 0.07f}, 0.8f * joint);
}

/// Style 0: tiles up to 2.6 m and concrete above; style 1: concrete only. u runs along the tunnel, v up or across.
Albedo lining(const TextureSample& t) {
  const float w = std::max(t.width_u, t.width_v);
  const float stain = 0.12f * smooth_noise(t.u / 3.1f, t.v / 0.9f, w / 0.9f, 141) +
                      0.08f * smooth_noise(t.u / 0.35f, t.v / 1.2f, w / 0.35f, 142);
  const float seam = covered_periodic(t.u, t.width_u, 6.0f, 0.0f, 0.05f);
  Albedo concrete = scaled({0.40f, 0.39f, 0.37f}, (1 + stain) * (1 - 0.6f * seam));
  if (t.tag.style == 1) return concrete;
  const float joint = std::max(covered_periodic(t.u, t.width_u, 0.30f, 0.0f, 0.012f),
                               covered_periodic(t.v, t.width_v, 0.20f, 0.0f, 0.012f));
  Albedo tiles = scaled({0.70f, 0.69f, 0.62f},
                        (1 + 0.06f * tile_tint(t.u, t.v, 0.30f, 0.20f, w, 143) + 0.6f * stain) * (1 - 0.45f * joint));
  tiles = mixed(tiles, {0.10f, 0.22f, 0.45f}, covered(t.v, t.width_v, 1.0f, 1.4f));
  // Exhaust makes the foot of the wall darker. Marks stand every 5 m and differ from their neighbours.
  tiles = scaled(tiles, 1 - 0.4f * std::exp(-std::max(0.0f, t.v) * 2.0f));
  const float cell = std::floor(t.u / 5.0f), x = t.u - 5.0f * cell,
              high = 1.6f + 0.1f * (cell - 4 * std::floor(cell / 4));
  tiles = mixed(tiles, {0.65f, 0.45f, 0.04f},
                covered(x, t.width_u, 0.6f, 1.0f + 0.1f * (cell - 3 * std::floor(cell / 3))) *
                    covered(t.v, t.width_v, high, high + 0.3f));
  return mixed(concrete, tiles, covered(t.v, t.width_v, -1.0f, 2.6f));
}

/// A tarpaulin with straps, a stripe, and letters as blocks 0.9 m high.
Albedo tarpaulin(const Albedo& paint, const TextureSample& t) {
  const Albedo white{0.78f, 0.77f, 0.74f};
  Albedo a = mixed(paint, white, covered(t.v, t.width_v, 0.35f, 0.55f));
  const float cell = std::floor(t.u / 0.8f), kind = cell - 5 * std::floor(cell / 5);
  const float letters = covered(t.v, t.width_v, 1.1f, 2.0f) * covered_periodic(t.u, t.width_u, 0.8f, 0.1f, 0.65f);
  const float gap = covered_periodic(t.u, t.width_u, 0.8f, 0.28f, 0.48f) *
                    covered(t.v, t.width_v, 1.25f + 0.1f * kind, 1.55f + 0.08f * kind);
  if (kind < 4) a = mixed(a, white, letters * (1 - gap));
  const float fold = smooth_noise(t.u / 0.5f, t.v / 2.0f, t.width_u / 0.5f, 211);
  return mixed(scaled(a, 1 + 0.08f * fold), {0.05f, 0.05f, 0.06f},
               0.8f * covered_periodic(t.u, t.width_u, 0.7f, 0.0f, 0.04f) * covered(t.v, t.width_v, -1.0f, 0.3f));
}

/// The wall of a room, with goods on shelves 0.5 m apart; `QuadTag::style` shifts their colours.
Albedo interior(const TextureSample& t) {
  static constexpr std::array<Albedo, 5> kGoods{
      {{.18f, .03f, .03f}, {.17f, .13f, .02f}, {.03f, .07f, .16f}, {.16f, .155f, .14f}, {.03f, .12f, .05f}}};
  const float column = std::floor(t.u / 0.4f), row = std::floor(t.v / 0.5f);
  const auto pick = static_cast<std::uint32_t>(static_cast<std::int32_t>(3 * column + 7 * row) + 1000) + t.tag.style;
  const float goods =
      covered_periodic(t.u, t.width_u, 0.4f, 0.05f, 0.35f) * covered_periodic(t.v, t.width_v, 0.5f, 0.04f, 0.38f);
  const float board = covered_periodic(t.v, t.width_v, 0.5f, 0.0f, 0.04f);
  return mixed(mixed({0.09f, 0.085f, 0.075f}, kGoods[pick % kGoods.size()], goods), {0.06f, 0.035f, 0.02f}, board);
}

Albedo rock(const TextureSample& t) {
  const float w = std::max(t.width_u, t.width_v);
  const float bent = t.v + 0.5f * smooth_noise(t.u / 6.0f, t.v / 6.0f, w / 6.0f, 151);
  const float strata = smooth_noise(t.u / 14.0f, bent / 0.7f, w / 0.7f, 152) +
                       0.5f * smooth_noise(t.u / 3.0f, bent / 0.2f, w / 0.2f, 153);
  const float grain = smooth_noise(t.u / 0.4f, t.v / 0.3f, w / 0.3f, 154);
  return scaled(mixed({0.42f, 0.34f, 0.25f}, {0.27f, 0.21f, 0.17f}, 0.5f + 0.5f * std::clamp(strata, -1.0f, 1.0f)),
                1 + 0.15f * grain);
}

}  // namespace

Albedo scene_albedo_at(const Scene& scene, const TextureSample& t) {
  const float w = std::max(t.width_u, t.width_v);
  switch (t.tag.material) {
    case Material::Plaza:
      return plaza(t);
    case Material::Cobble:
      return cobble(t);
    case Material::Soil:
      return scaled({0.13f, 0.08f, 0.05f}, 1 + 0.4f * smooth_noise(t.u / 0.06f, t.v / 0.06f, w / 0.06f, 161));
    case Material::Flower: {
      static constexpr std::array<Albedo, 6> kPetals{{{.72f, .05f, .06f},
                                                      {.85f, .62f, .04f},
                                                      {.55f, .10f, .50f},
                                                      {.80f, .78f, .74f},
                                                      {.85f, .30f, .04f},
                                                      {.12f, .14f, .60f}}};
      return kPetals[t.tag.style % kPetals.size()];
    }
    case Material::Marble: {
      const float vein = smooth_noise(t.u / 0.5f + 0.8f * smooth_noise(t.u, t.v, w, 171), t.v / 0.9f, w / 0.5f, 172);
      const Albedo base = t.tag.style == 0 ? Albedo{0.58f, 0.55f, 0.49f} : Albedo{0.36f, 0.29f, 0.27f};
      return scaled(base, 1 - 0.16f * std::abs(vein) + 0.05f * smooth_noise(t.u / 0.07f, t.v / 0.07f, w / 0.07f, 173));
    }
    case Material::Wood:
      return scaled({0.34f, 0.20f, 0.10f}, 1 + 0.25f * smooth_noise(t.u / 0.6f, t.v / 0.02f, w / 0.02f, 181));
    case Material::Lining:
      return lining(t);
    case Material::Gravel: {
      const float n = 0.12f * smooth_noise(t.u / 2.1f, t.v / 2.1f, w / 2.1f, 191) +
                      0.25f * smooth_noise(t.u / 0.12f, t.v / 0.12f, w / 0.12f, 192) +
                      0.10f * smooth_noise(t.u / 0.6f, t.v / 0.6f, w / 0.6f, 193);
      return scaled({0.38f, 0.34f, 0.28f}, 1 + n);
    }
    case Material::Rock:
      return rock(t);
    case Material::Cloth:
      return scaled(scene.paints[t.tag.style % scene.paints.size()],
                    0.9f + 0.1f * smooth_noise(t.u / 0.12f, t.v / 0.3f, w / 0.12f, 201));
    case Material::Interior:
      return interior(t);
    case Material::Openwork:
      return t.tag.style == 0 ? Albedo{0.03f, 0.14f, 0.07f} : Albedo{0.42f, 0.43f, 0.44f};
    case Material::Wire:
      return {0.10f, 0.09f, 0.08f};
    case Material::Tarpaulin:
      return tarpaulin(scene.paints[t.tag.style], t);
    case Material::Skin:
      return {0.52f, 0.33f, 0.24f};
    case Material::LampGlass:
      return {0.85f, 0.85f, 0.80f};
    case Material::TargetWhite:
      return {0.80f, 0.80f, 0.78f};
    default:
      return {0.5f, 0.5f, 0.5f};
  }
}

}  // namespace hueline::sim
