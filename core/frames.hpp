#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

/// Frames are types. T_enu_body * T_body_camera compiles; the reverse does not. Axes are stated here, once;
/// docs/conventions.md says the same in words.
namespace hueline {

/// WGS84 earth-centred earth-fixed, m: x to (0 N, 0 E), z to the north pole.
struct Ecef {};
/// Local level at a named origin: x east, y north, z up, m.
struct Enu {};
/// The vehicle: x right, y forward, z up; origin at the IMU's centre of navigation. (NovAtel SPAN's vehicle frame.)
struct Body {};
/// A laser scanner's own frame, as its maker draws it. Velodyne: z up, y forward (azimuth 0), x right.
struct Scanner {};
/// A camera head: x forward (lens 0), y left, z up. (Ladybug's head frame.)
struct CameraHead {};
/// One lens: x right in the image, y down, z along the optical axis.
struct Lens {};

/// A position of frame F in metres.
template <class F>
struct Point {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
};

/// A direction or difference in frame F: rotated by a Transform, not shifted.
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

/// Rotation from frame From into frame To: v_to = R_to_from * v_from.
template <class To, class From>
struct Rotation {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
};

/// Rigid transform: p_to = T_to_from * p_from. `translation` is the position of From's origin in To.
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

/// Attitude of Body against Enu, rad. roll: right side down positive; pitch: nose up positive; heading: clockwise from
/// north.
struct Attitude {
  double roll = 0, pitch = 0, heading = 0;
};

/// R_enu_body: heading about -z, then pitch about +x, then roll about +y. Docs/methods equation 2.
inline Eigen::Quaterniond rotation_enu_body(const Attitude& a) {
  return Eigen::AngleAxisd(-a.heading, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(a.pitch, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(a.roll, Eigen::Vector3d::UnitY());
}

/// The inverse of rotation_enu_body; heading in [0, 2 pi). At pitch +-90 deg roll is taken as 0.
inline Attitude attitude_from_enu_body(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  Attitude a;
  const double s = std::min(1.0, std::max(-1.0, R(2, 1)));
  a.pitch = std::asin(s);
  if (std::abs(s) < 1.0 - 1e-12) {
    a.roll = std::atan2(-R(2, 0), R(2, 2));
    a.heading = std::atan2(R(0, 1), R(1, 1));
  } else {
    a.heading = std::atan2(-R(1, 0), R(0, 0));
  }
  if (a.heading < 0) a.heading += 2.0 * 3.14159265358979323846;
  return a;
}

}  // namespace hueline
