#include "core/portable_math.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

namespace hueline::portable {
namespace {

constexpr double kPi = std::numbers::pi, kPiRest = 1.2246467991473532e-16;  // pi is the sum of both
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
// A quarter of a turn, and the logarithm of 2, in parts. Products of the first parts with numbers of 20 bits are exact.
constexpr double kQuarter1 = 0x1.921fb544p+0, kQuarter2 = 0x1.0b4611a6p-34, kQuarter3 = 0x1.3198a2e037073p-69;
constexpr double kLog2High = 0x1.62e42feep-1, kLog2Low = 0x1.a39ef35793c76p-33;

/// An angle of -pi/4 to pi/4 as a sum, and the quarters of a turn before it.
struct Reduced {
  double angle, rest;
  int quarters;
};

Reduced reduce(double angle) {
  constexpr double kLargest = 1e6;
  if (std::abs(angle) > kLargest) angle = std::fmod(angle, 2 * kPi);
  const double quarters = std::nearbyint(angle / kQuarter1);
  const double first = angle - quarters * kQuarter1, second = quarters * kQuarter2;
  const double reduced = first - second;
  const double rest = (first - reduced) - second - quarters * kQuarter3;
  return {reduced, rest, static_cast<int>(quarters) & 3};
}

// The series of the functions. Each ends where the next term is below a hundredth of the last place.
double sine_of(double x, double rest) {
  const double q = x * x;
  double sum = 1 / 355687428096000.0;  // 17!
  for (const double term :
       {-1 / 1307674368000.0, 1 / 6227020800.0, -1 / 39916800.0, 1 / 362880.0, -1 / 5040.0, 1 / 120.0, -1 / 6.0})
    sum = term + q * sum;
  return x + (x * q * sum + rest * (1 - 0.5 * q));
}

double cosine_of(double x, double rest) {
  const double q = x * x;
  double sum = 1 / 6402373705728000.0;  // 18!
  sum = -sum;
  for (const double term :
       {1 / 20922789888000.0, -1 / 87178291200.0, 1 / 479001600.0, -1 / 3628800.0, 1 / 40320.0, -1 / 720.0, 1 / 24.0})
    sum = term + q * sum;
  const double half = 0.5 * q, most = 1 - half;
  return most + (((1 - most) - half) + (q * q * sum - x * rest));
}

/// Of a number of 0 to 1.
double small_arc_tangent(double x) {
  // The arc tangents of eighths, as sums.
  constexpr double kEighths[9][2] = {{0, 0},
                                     {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
                                     {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
                                     {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
                                     {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
                                     {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
                                     {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
                                     {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
                                     {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}};
  const auto eighth = static_cast<std::size_t>(std::nearbyint(8 * x));
  const double near = static_cast<double>(eighth) / 8, t = (x - near) / (1 + x * near), q = t * t;
  double sum = 0;
  for (int k = 15; k >= 3; k -= 2) sum = q * ((k / 2 % 2 == 0 ? 1.0 : -1.0) / k + sum);
  return kEighths[eighth][0] + (t + (t * sum + kEighths[eighth][1]));
}

/// Of a number of 0 to infinity.
double positive_arc_tangent(double x) {
  return x <= 1 ? small_arc_tangent(x) : kPi / 2 - (small_arc_tangent(1 / x) - kPiRest / 2);
}

}  // namespace

double sin(double angle) {
  if (!std::isfinite(angle)) return kNaN;
  const auto [x, rest, quarters] = reduce(angle);
  const double size = quarters % 2 == 0 ? sine_of(x, rest) : cosine_of(x, rest);
  return quarters < 2 ? size : -size;
}

double cos(double angle) {
  if (!std::isfinite(angle)) return kNaN;
  const auto [x, rest, quarters] = reduce(angle);
  const double size = quarters % 2 == 0 ? cosine_of(x, rest) : sine_of(x, rest);
  return quarters == 1 || quarters == 2 ? -size : size;
}

double tan(double angle) { return sin(angle) / cos(angle); }

double atan(double x) {
  if (std::isnan(x)) return kNaN;
  return std::copysign(positive_arc_tangent(std::abs(x)), x);
}

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return kNaN;
  const double across = std::abs(y), along = std::abs(x);
  double angle = 0;
  if (std::isinf(across) && std::isinf(along)) {
    angle = kPi / 4;
  } else if (across != 0 || along != 0) {
    angle = across <= along ? positive_arc_tangent(across / along)
                            : kPi / 2 - (positive_arc_tangent(along / across) - kPiRest / 2);
  }
  if (std::signbit(x)) angle = kPi - (angle - kPiRest);
  return std::copysign(angle, y);
}

double asin(double x) { return atan2(x, std::sqrt((1 - x) * (1 + x))); }
double acos(double x) { return 2 * atan2(std::sqrt(1 - x), std::sqrt(1 + x)); }

double sinh(double x) {
  const double size = std::abs(x);
  if (size < 0.5) {
    const double q = x * x;
    double sum = 0;
    for (int k = 15; k >= 3; k -= 2) sum = q / (k * (k - 1)) * (1 + sum);
    return x + x * sum;
  }
  const double e = exp(size);
  return std::copysign(0.5 * (e - 1 / e), x);
}

double exp(double x) {
  if (std::isnan(x)) return kNaN;
  if (x > 710) return kInfinity;
  if (x < -746) return 0;
  const double doublings = std::nearbyint(x / std::numbers::ln2);
  const double high = x - doublings * kLog2High, low = doublings * kLog2Low, r = high - low;
  const double rest = (high - r) - low;
  double sum = 0;
  for (int k = 14; k >= 2; --k) sum = r / k * (1 + sum);
  return std::ldexp(1 + (r + (r * sum + rest)), static_cast<int>(doublings));
}

double log(double x) {
  if (std::isnan(x) || x < 0) return kNaN;
  if (x == 0) return -kInfinity;
  if (std::isinf(x)) return x;
  int doublings = 0;
  double m = std::frexp(x, &doublings);
  if (m < std::numbers::sqrt2 / 2) {
    m *= 2;
    --doublings;
  }
  // log(1 + f) = f - f^2/2 + s (f^2/2 + 2 s^2/3 + 2 s^4/5 + ...) with s = f / (2 + f)
  const double f = m - 1, s = f / (2 + f), q = s * s, half = 0.5 * f * f;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = q * (2.0 / k + sum);
  return doublings * kLog2High + (f - (half - (s * (half + sum) + doublings * kLog2Low)));
}

double pow(double x, double y) {
  if (y == 0) return 1;
  if (x == 0) return y > 0 ? 0 : kInfinity;
  return exp(y * log(x));
}

double hypot(double x, double y) { return std::sqrt(x * x + y * y); }
double hypot(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

Eigen::Quaterniond rotation_about(const Eigen::Vector3d& axis, double angle) {
  const double sine = sin(0.5 * angle);
  return {cos(0.5 * angle), sine * axis.x(), sine * axis.y(), sine * axis.z()};
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  // A quaternion and its negative are one rotation; the shorter way round is taken.
  const double sign = rotation.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double sine = hypot(v.x(), v.y(), v.z()), cosine = sign * rotation.w();
  return sine < 1e-12 ? Eigen::Vector3d(2.0 * v) : Eigen::Vector3d(v * (2.0 * atan2(sine, cosine) / sine));
}

}  // namespace hueline::portable
