#pragma once

#include <Eigen/Geometry>

/// Elementary functions whose results have the same bits on every machine. Those of the C library do not: it has
/// variants for processors that fuse a multiplication with an addition, which differ in the last place now and then.
/// Whatever decides a byte of a recording's products uses these, so that a drive that one computer captured is replayed
/// to the same bytes by another kind of computer.
///
/// They use additions, multiplications, divisions, square roots and roundings, which IEEE 754 defines to the bit, in a
/// fixed order. Angles are in rad. Errors are within 3 units in the last place, of pow() within 3 + |y log x|; angles
/// beyond a million rad lose accuracy. Arguments out of the domain give NaN. Pure functions.
namespace hueline::portable {

double sin(double angle);
double cos(double angle);
double tan(double angle);
double atan(double x);
/// Returns the angle of the direction (x, y) from the x axis, -pi to pi; atan2(0, 0) is 0.
double atan2(double y, double x);
double asin(double x);
double acos(double x);
double sinh(double x);
double exp(double x);
double log(double x);
double pow(double x, double y);  ///< for x >= 0
constexpr double square(double x) { return x * x; }
/// Return the length of a vector, whose square must be neither too large nor too small for a double.
double hypot(double x, double y);
double hypot(double x, double y, double z);

/// Returns the rotation by an angle about an axis of length 1.
Eigen::Quaterniond rotation_about(const Eigen::Vector3d& axis, double angle);
/// Returns the axis of a rotation, times its angle of 0 to pi.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);

}  // namespace hueline::portable
