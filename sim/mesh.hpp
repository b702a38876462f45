#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/vec3.hpp"

namespace hueline::sim {

enum class Material : std::uint8_t {
  Asphalt,
  Pavement,
  Kerb,
  Grass,
  Facade,
  SideWall,
  Roof,
  Stone,
  Brick,
  Awning,
  Bark,
  Leaf,
  Steel,
  SignFace,
  CarPaint,
  CarGlass,
  CarEnd,
  Tyre,
  Plaza,  ///< large slabs in two colours
  Cobble,
  Soil,
  Flower,  ///< style picks its colour
  Marble,
  Wood,
  Lining,     ///< of a tunnel: tiles below, concrete above
  LampGlass,  ///< shines by itself
  Gravel,
  Rock,
  TargetWhite,
  Cloth,
  Skin,
};

/// What a quad is made of. `surface` indexes the scene's list of names; `style` picks a variant (building, car colour,
/// leaf tint).
struct QuadTag {
  Material material = Material::Asphalt;
  std::uint16_t surface = 0;
  std::uint32_t style = 0;
};

/// Texture coordinates, m (or a part's own unit), at a corner.
struct TexturePoint {
  double u = 0, v = 0;
};

/// Quads with texture coordinates; corners anticlockwise seen from outside. Corner 0 -> 1 is u, 0 -> 3 is v where
/// nothing else is said.
class Mesh {
 public:
  struct Face {
    QuadTag tag;
    std::array<std::uint32_t, 4> corner;
    /// Unit normal (of the first triangle) and gradients of u and v along the surface, 1/m.
    std::array<float, 3> normal, grad_u, grad_v;
  };

  void quad(const std::array<Vec3, 4>& p, const std::array<TexturePoint, 4>& t, QuadTag tag);
  /// u over the length of p0 p1 and v over the length of p0 p3, both from 0.
  void rectangle(const std::array<Vec3, 4>& p, QuadTag tag);
  /// Box in the frame T: from lo to hi; no bottom. u, v in m on each side.
  void box(const Pose& T, Vec3 lo, Vec3 hi, QuadTag tag);
  /// Upright prism of `sides` between two radii; capped on top. u around (m), v up (m).
  void cylinder(Vec3 foot, double radius_foot, double radius_top, double height, int sides, QuadTag tag);
  /// Prism of `sides` from a to b, open at its ends. u around (m), v from a to b (m).
  void rod(Vec3 a, Vec3 b, double radius, int sides, QuadTag tag);
  /// Quads on the ellipsoid with these half axes along x, y, z: `rings` from pole to pole, `sides` around. u around
  /// (m), v up (m). The quads' planes lie inside the ellipsoid by up to r (1 - cos(pi / sides)).
  void ellipsoid(Vec3 centre, Vec3 half_axes, int rings, int sides, QuadTag tag);

  const std::vector<std::array<float, 3>>& vertices() const { return vertices_; }
  const std::vector<std::array<float, 2>>& texture() const { return texture_; }
  const std::vector<Face>& faces() const { return faces_; }

 private:
  std::vector<std::array<float, 3>> vertices_;
  std::vector<std::array<float, 2>> texture_;
  std::vector<Face> faces_;
};

}  // namespace hueline::sim
