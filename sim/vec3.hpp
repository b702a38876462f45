#pragma once

#include <array>
#include <cmath>

/// The simulator's own vector arithmetic in plain doubles. It is deliberately separate from core/frames.hpp, so that
/// the program under test and its judge cannot share a mistake. Names carry the frames: R_a_b turns coordinates of b
/// into coordinates of a.
namespace hueline::sim {

constexpr double kPi = 3.14159265358979323846;
constexpr double radians(double degrees) { return degrees * (kPi / 180.0); }
constexpr double degrees(double rad) { return rad * (180.0 / kPi); }

struct Vec3 {
  double x = 0, y = 0, z = 0;
};
constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double length(Vec3 a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalised(Vec3 a) { return (1.0 / length(a)) * a; }
/// Returns the angle between two directions, rad. It is accurate for small angles too, where acos(dot) is not.
inline double angle_between(Vec3 a, Vec3 b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

/// A 3 x 3 matrix, row-major.
struct Mat3 {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
};
constexpr Vec3 operator*(const Mat3& a, Vec3 v) {
  return {a.m[0] * v.x + a.m[1] * v.y + a.m[2] * v.z, a.m[3] * v.x + a.m[4] * v.y + a.m[5] * v.z,
          a.m[6] * v.x + a.m[7] * v.y + a.m[8] * v.z};
}
constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      c.m[3 * i + j] = a.m[3 * i] * b.m[j] + a.m[3 * i + 1] * b.m[3 + j] + a.m[3 * i + 2] * b.m[6 + j];
  return c;
}
constexpr Mat3 transposed(const Mat3& a) {
  return {{a.m[0], a.m[3], a.m[6], a.m[1], a.m[4], a.m[7], a.m[2], a.m[5], a.m[8]}};
}
/// Return the rotation of a vector about an axis by `a` rad, right-handed: rotation_z(90 deg) * x = y.
inline Mat3 rotation_x(double a) {
  const double c = std::cos(a), s = std::sin(a);
  return {{1, 0, 0, 0, c, -s, 0, s, c}};
}
inline Mat3 rotation_y(double a) {
  const double c = std::cos(a), s = std::sin(a);
  return {{c, 0, s, 0, 1, 0, -s, 0, c}};
}
inline Mat3 rotation_z(double a) {
  const double c = std::cos(a), s = std::sin(a);
  return {{c, -s, 0, s, c, 0, 0, 0, 1}};
}
/// Returns the rotation about x first, then y, then z, all about the fixed axes: Rz * Ry * Rx.
inline Mat3 rotation_zyx(double about_x, double about_y, double about_z) {
  return rotation_z(about_z) * rotation_y(about_y) * rotation_x(about_x);
}

/// A rigid transform: p_a = R_a_b * p_b + p_a_b, where p_a_b is the place of b's origin in a.
struct Pose {
  Mat3 R;
  Vec3 p;
};
constexpr Vec3 operator*(const Pose& T, Vec3 v) { return T.R * v + T.p; }
constexpr Pose operator*(const Pose& T_a_b, const Pose& T_b_c) {
  return {T_a_b.R * T_b_c.R, T_a_b.R * T_b_c.p + T_a_b.p};
}
constexpr Pose inverse(const Pose& T) {
  const Mat3 back = transposed(T.R);
  return {back, -1.0 * (back * T.p)};
}

}  // namespace hueline::sim
