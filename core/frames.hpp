#pragma once

#include <algorithm>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/portable_math.hpp"

/// Coordinate frames as types: T_enu_body * T_body_camera compiles, the reverse does not. The axes are defined here;
/// docs/conventions.md describes them in words.
namespace hueline {

/// WGS84, earth-centred and earth-fixed, m: x to (0 N, 0 E), z to the north pole.
struct Ecef {};
/// The local level at a named origin, m: x east, y north, z up.
struct Enu {};
/// The vehicle: x right, y forward, z up. The origin is the IMU's centre of navigation. This is NovAtel SPAN's vehicle
/// frame.
struct Body {};
/// A laser scanner's own frame, as its maker defines it. Velodyne: x right, y forward (azimuth 0), z up.
struct Scanner {};
/// A camera head: x forward (lens 0), y left, z up. This is Ladybug's head frame.
struct CameraHead {};
/// One lens: x right in the image, y down, z along the optical axis.
struct Lens {};

/// A position in frame F, in metres.
template <class F>
struct Point {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
};

/// A direction or a difference of positions in frame F. A Transform rotates it, but does not shift it.
template <class F>
struct Vector {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
};

template <class F>
Vector<F> operator-(const Point<F>& a, const Point<F>& b) {
  return {a.xyz - b.xyz};
}
template <class F>
Point<F> operator+(const Point<F>& a, const Vector<F>& b) {
  return {a.xyz + b.xyz};
}

/// A rotation from frame From into frame To: v_to = R_to_from * v_from.
template <class To, class From>
struct Rotation {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
};

/// A rigid transform from frame From into frame To: p_to = T_to_from * p_from. `translation` is the position of From's
/// origin in To.
template <class To, class From>
struct Transform {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Transform<From, To> inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation)};
  }
};

template <class A, class B, class C>
Transform<A, C> operator*(const Transform<A, B>& T_a_b, const Transform<B, C>& T_b_c) {
  return {(T_a_b.rotation * T_b_c.rotation).normalized(), T_a_b.rotation * T_b_c.translation + T_a_b.translation};
}
template <class A, class B>
Point<A> operator*(const Transform<A, B>& T_a_b, const Point<B>& p_b) {
  return {T_a_b.rotation * p_b.xyz + T_a_b.translation};
}
template <class A, class B>
Vector<A> operator*(const Transform<A, B>& T_a_b, const Vector<B>& v_b) {
  return {T_a_b.rotation * v_b.xyz};
}

/// The attitude of Body in Enu, rad. Roll is positive when the right side is down, pitch is positive when the nose is
/// up, heading is clockwise from north.
struct Attitude {
  double roll = 0, pitch = 0, heading = 0;
};

/// Returns R_enu_body: a turn by roll about +y, then by pitch about +x, then by heading about -z (docs/methods,
/// equation 2).
inline Eigen::Quaterniond rotation_enu_body(const Attitude& a) {
  using portable::rotation_about, Eigen::Vector3d;
  return rotation_about(Vector3d::UnitZ(), -a.heading) * rotation_about(Vector3d::UnitX(), a.pitch) *
         rotation_about(Vector3d::UnitY(), a.roll);
}

/// Inverse of rotation_enu_body(). The heading is in [0, 2 pi). At a pitch of +-90 deg the roll is set to 0.
inline Attitude attitude_from_enu_body(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  Attitude a;
  const double s = std::min(1.0, std::max(-1.0, R(2, 1)));
  a.pitch = portable::asin(s);
  if (std::abs(s) < 1.0 - 1e-12) {
    a.roll = portable::atan2(-R(2, 0), R(2, 2));
    a.heading = portable::atan2(R(0, 1), R(1, 1));
  } else {
    a.heading = portable::atan2(-R(1, 0), R(0, 0));
  }
  constexpr double kTurn = 2.0 * 3.14159265358979323846;
  if (a.heading < 0) a.heading += kTurn;
  if (a.heading >= kTurn) a.heading = 0;  // it was less than 0 by less than the last place
  return a;
}

}  // namespace hueline
