#include "sim/mesh.hpp"

namespace hueline::sim {
namespace {
std::array<float, 3> narrow(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
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
    if (i % 2 == 0 && r1 > 0.001)  // the lid: a quad covers two of its triangles
      rectangle({at(i, r1, height), at(i + 1, r1, height), at(i + 2, r1, height), foot + Vec3{0, 0, height}}, tag);
  }
}

void Mesh::rod(Vec3 a, Vec3 b, double radius, int sides, QuadTag tag) {
  const Vec3 axis = normalised(b - a);
  const Vec3 x = normalised(cross(std::abs(axis.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, axis)), y = cross(axis, x);
  const double height = length(b - a);
  const auto rim = [&](Vec3 from, int i) {
    const double t = 2 * kPi * i / sides;
    return from + radius * (std::cos(t) * x + std::sin(t) * y);
  };
  for (int i = 0; i < sides; ++i) {
    const double u0 = 2 * kPi * radius * i / sides, u1 = 2 * kPi * radius * (i + 1) / sides;
    quad({rim(a, i), rim(a, i + 1), rim(b, i + 1), rim(b, i)}, {{{u0, 0}, {u1, 0}, {u1, height}, {u0, height}}}, tag);
  }
}

void Mesh::ellipsoid(Vec3 centre, Vec3 half, int rings, int sides, QuadTag tag) {
  const auto at = [&](int i, int j) {
    const double a = 2 * kPi * i / sides, t = kPi * j / rings;  // t from the lower pole
    return centre + Vec3{half.x * std::sin(t) * std::cos(a), half.y * std::sin(t) * std::sin(a), -half.z * std::cos(t)};
  };
  const auto uv = [&](int i, int j) { return TexturePoint{2 * kPi * half.x * i / sides, kPi * half.z * j / rings}; };
  for (int j = 0; j < rings; ++j)
    for (int i = 0; i < sides; ++i) {
      if (j == 0)  // a triangle at the pole; its first corner must not be the doubled one
        quad({at(i + 1, 1), at(i, 1), at(i, 0), at(i + 1, 0)}, {{uv(i + 1, 1), uv(i, 1), uv(i, 0), uv(i + 1, 0)}}, tag);
      else
        quad({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)},
             {{uv(i, j), uv(i + 1, j), uv(i + 1, j + 1), uv(i, j + 1)}}, tag);
    }
}

}  // namespace hueline::sim
