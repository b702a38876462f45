#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/vec3.hpp"

namespace hueline::sim {

/// What a surface is made of; decides its texture (texture.hpp).
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
  Flower,  ///< `QuadTag::style` selects its colour
  Marble,
  Wood,
  Lining,     ///< of a tunnel: tiles below, concrete above
  LampGlass,  ///< emits light itself
  Gravel,
  Rock,
  TargetWhite,
  Cloth,
  Skin,
  Pane,       ///< of glass; in Scene::sheer only
  Openwork,   ///< a fence; style 0: bars, 1: chain link; in Scene::sheer only
  Wire,       ///< the sheath of a wire; `QuadTag::style` is an index into Scene::wires; in Scene::sheer only
  Interior,   ///< walls of a room with shelves
  Tarpaulin,  ///< of a lorry, with stripes and lettering; `QuadTag::style` selects its paint
};

/// What a quad is made of. `surface` is an index into the scene's list of names; `style` selects a variant (building,
/// colour of a car, tint of a leaf).
struct QuadTag {
  Material material = Material::Asphalt;
  std::uint16_t surface = 0;
  std::uint32_t style = 0;
};

/// Texture coordinates at a corner, in m unless the part that adds the quad has a unit of its own.
struct TexturePoint {
  double u = 0, v = 0;
};

/// Quads with texture coordinates. Corners run anticlockwise seen from outside. Unless a function says otherwise, u
/// grows from corner 0 to 1 and v from corner 0 to 3.
class Mesh {
 public:
  /// One quad; `corner` holds indices into vertices() and texture().
  struct Face {
    QuadTag tag;
    std::array<std::uint32_t, 4> corner;
    /// Unit normal of the first triangle, and gradients of u and v along the surface, 1/m.
    std::array<float, 3> normal, grad_u, grad_v;
  };

  /// Adds a quad with the given texture coordinates.
  void quad(const std::array<Vec3, 4>& p, const std::array<TexturePoint, 4>& t, QuadTag tag);
  /// Adds a rectangle: u runs from 0 over the length of p0 p1, v from 0 over the length of p0 p3.
  void rectangle(const std::array<Vec3, 4>& p, QuadTag tag);
  /// Adds a box from `lo` to `hi` in the frame T, without a bottom. u and v are in m on each side.
  void box(const Pose& T, Vec3 lo, Vec3 hi, QuadTag tag);
  /// Adds an upright prism of `sides` between two radii, with a lid. u runs around it (m), v up (m).
  void cylinder(Vec3 foot, double radius_foot, double radius_top, double height, int sides, QuadTag tag);
  /// Adds a prism of `sides` from a to b, open at its ends. u runs around it (m), v from a to b (m).
  void rod(Vec3 a, Vec3 b, double radius, int sides, QuadTag tag);
  /// Adds an ellipsoid with the given half axes along x, y, z, as quads: `rings` from pole to pole, `sides` around. u
  /// runs around it (m), v up (m). The planes of the quads lie inside the ellipsoid by at most r (1 - cos(pi / sides)).
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
