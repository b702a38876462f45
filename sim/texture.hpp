#pragma once

#include "sim/scene.hpp"

namespace hueline::sim {

/// A point of a surface and the size of the ray's footprint there. Textures are averaged over the footprint, so that
/// they never alias.
struct TextureSample {
  QuadTag tag;
  float u = 0, v = 0;              ///< texture coordinates
  float width_u = 0, width_v = 0;  ///< size of the footprint, in the same units
};

inline Albedo scaled(Albedo a, float s) { return {a.r * s, a.g * s, a.b * s}; }
/// Returns `a` at t = 0, `b` at 1, and between them their mixture.
inline Albedo mixed(Albedo a, Albedo b, float t) {
  return {a.r + (b.r - a.r) * t, a.g + (b.g - a.g) * t, a.b + (b.b - a.b) * t};
}

/// Returns the reflectance of the surface. Thread-safe.
Albedo albedo_at(const Scene& scene, const TextureSample& at);

/// Returns the same for the materials of the scenes other than the street (texture_scenes.cpp).
Albedo scene_albedo_at(const Scene& scene, const TextureSample& at);

/// Returns the share of a footprint on Material::CarEnd that the glass of its lamps covers.
float headlight_share(const TextureSample& at);

/// Returns the share of a footprint of width w around x that lies in [a, b]: the exact box filter of a step texture.
float covered(float x, float w, float a, float b);
/// Returns the same for [a, b] repeated every `period`.
float covered_periodic(float x, float w, float period, float a, float b);
/// Returns a random value in -1 .. 1 that is constant on each tile of du x dv. It fades out as the tiles become smaller
/// than the footprint w.
float tile_tint(float u, float v, float du, float dv, float w, std::uint32_t seed);
/// Returns smooth lattice noise of mean 0, about -1 .. 1, with lattice cells of size 1. It fades to 0 as the footprint
/// (in cells) grows larger than a cell.
float smooth_noise(float x, float y, float footprint, std::uint32_t seed);

}  // namespace hueline::sim
