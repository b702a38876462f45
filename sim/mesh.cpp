#include "sim/mesh.hpp"

namespace hueline::sim {
namespace {
std::array<float, 3> narrow(Vec3 v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }
}  // namespace

void Mesh::quad(const std::array<Vec3, 4>& p, const std::array<TexturePoint, 4>& t, QuadTag tag) {
  Face face;
  face.tag = tag;
  for (std::size_t i = 0; i < 4; ++i) {
    face.corner[i] = static_cast<std::uint32_t>(vertices_.size());
    vertices_.push_back(narrow(p[i]));
    texture_.push_back({static_cast<float>(t[i].u), static_cast<float>(t[i].v)});
  }
  const Vec3 a = p[1] - p[0], b = p[3] - p[0], n = cross(a, b);
  const double area2 = dot(n, n);
  const auto gradient = [&](double da, double db) { return (1.0 / area2) * (da * cross(b, n) + db * cross(n, a)); };
  face.normal = narrow((1.0 / std::sqrt(area2)) * n);
  face.grad_u = narrow(gradient(t[1].u - t[0].u, t[3].u - t[0].u));
  face.grad_v = narrow(gradient(t[1].v - t[0].v, t[3].v - t[0].v));
  faces_.push_back(face);
}

void Mesh::rectangle(const std::array<Vec3, 4>& p, QuadTag tag) {
  const double w = length(p[1] - p[0]), h = length(p[3] - p[0]);
  quad(p, {{{0, 0}, {w, 0}, {w, h}, {0, h}}}, tag);
}

void Mesh::box(const Pose& T, Vec3 lo, Vec3 hi, QuadTag tag) {
  const auto at = [&](double x, double y, double z) { return T * Vec3{x, y, z}; };
  rectangle({at(lo.x, lo.y, lo.z), at(hi.x, lo.y, lo.z), at(hi.x, lo.y, hi.z), at(lo.x, lo.y, hi.z)}, tag);
  rectangle({at(hi.x, lo.y, lo.z), at(hi.x, hi.y, lo.z), at(hi.x, hi.y, hi.z), at(hi.x, lo.y, hi.z)}, tag);
  rectangle({at(hi.x, hi.y, lo.z), at(lo.x, hi.y, lo.z), at(lo.x, hi.y, hi.z), at(hi.x, hi.y, hi.z)}, tag);
  rectangle({at(lo.x, hi.y, lo.z), at(lo.x, lo.y, lo.z), at(lo.x, lo.y, hi.z), at(lo.x, hi.y, hi.z)}, tag);
  rectangle({at(lo.x, lo.y, hi.z), at(hi.x, lo.y, hi.z), at(hi.x, hi.y, hi.z), at(lo.x, hi.y, hi.z)}, tag);
}

void Mesh::cylinder(Vec3 foot, double r0, double r1, double height, int sides, QuadTag tag) {
  const auto at = [&](int i, double r, double z) {
    const double a = 2 * kPi * i / sides;
    return foot + Vec3{r * std::cos(a), r * std::sin(a), z};
  };
  for (int i = 0; i < sides; ++i) {
    const double u0 = 2 * kPi * r0 * i / sides, u1 = 2 * kPi * r0 * (i + 1) / sides;
    quad({at(i, r0, 0), at(i + 1, r0, 0), at(i + 1, r1, height), at(i, r1, height)},
         {{{u0, 0}, {u1, 0}, {u1, height}, {u0, height}}}, tag);
    if (i % 2 == 0 && r1 > 0.001)  // cap: two sides a quad
      rectangle({at(i, r1, height), at(i + 1, r1, height), at(i + 2, r1, height), foot + Vec3{0, 0, height}}, tag);
  }
}

}  // namespace hueline::sim
