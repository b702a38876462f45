#pragma once

#include "sim/scene.hpp"

namespace hueline::sim {

/// A point of a surface and the size of the ray's footprint there: textures are averaged over it, so that they never
/// alias.
struct TextureSample {
  QuadTag tag;
  float u = 0, v = 0;              ///< texture coordinates
  float width_u = 0, width_v = 0;  ///< footprint, in the same units
};

/// Reflectance of the surface. Thread-safe.
Albedo albedo_at(const Scene& scene, const TextureSample& at);

/// The same for the materials of the scenes beside the street (texture_scenes.cpp).
Albedo scene_albedo_at(const Scene& scene, const TextureSample& at);

/// Share of a footprint of width w around x that lies in [a, b]: exact box filter of a step texture.
float covered(float x, float w, float a, float b);
/// The same for [a, b] repeated every `period`.
float covered_periodic(float x, float w, float period, float a, float b);
/// -1 .. 1, one value a tile of du x dv, fading out as tiles become smaller than the footprint w.
float tile_tint(float u, float v, float du, float dv, float w, std::uint32_t seed);
/// Smooth lattice noise, mean 0, about -1 .. 1, one lattice cell = 1; fades to 0 as the footprint (in cells) grows past
/// a cell.
float smooth_noise(float x, float y, float footprint, std::uint32_t seed);

}  // namespace hueline::sim
