#include "core/geodesy.hpp"

#include <cmath>
#include <numbers>

#include "core/portable_math.hpp"

namespace hueline {
namespace {
constexpr double kA = 6378137.0;            // semi-major axis, m
constexpr double kF = 1.0 / 298.257223563;  // flattening
constexpr double kB = kA * (1.0 - kF);      // semi-minor axis, m
constexpr double kE2 = kF * (2.0 - kF);     // first eccentricity squared
constexpr double kEp2 = kE2 / (1.0 - kE2);  // second eccentricity squared
}  // namespace

bool is_on_earth(const Geodetic& g) {
  return std::abs(g.latitude) <= std::numbers::pi / 2 && std::abs(g.longitude) <= std::numbers::pi &&
         std::abs(g.ellipsoidal_height) < 1e5;
}

Point<Ecef> to_ecef(const Geodetic& g) {
  const double s = portable::sin(g.latitude), c = portable::cos(g.latitude);
  const double n = kA / std::sqrt(1.0 - kE2 * s * s);
  return {{(n + g.ellipsoidal_height) * c * portable::cos(g.longitude),
           (n + g.ellipsoidal_height) * c * portable::sin(g.longitude), (n * (1.0 - kE2) + g.ellipsoidal_height) * s}};
}

Geodetic to_geodetic(const Point<Ecef>& p) {
  const double x = p.xyz.x(), y = p.xyz.y(), z = p.xyz.z();
  const double rho = portable::hypot(x, y);
  double beta = portable::atan2(z * kA, rho * kB);  // reduced latitude
  double latitude = 0;
  for (int i = 0; i < 2; ++i) {
    const double sb = portable::sin(beta), cb = portable::cos(beta);
    latitude = portable::atan2(z + kEp2 * kB * sb * sb * sb, rho - kE2 * kA * cb * cb * cb);
    beta = portable::atan2((1.0 - kF) * portable::sin(latitude), portable::cos(latitude));
  }
  const double s = portable::sin(latitude), c = portable::cos(latitude);
  // The distance along the normal, from both components; this is stable at the poles too.
  const double height = rho * c + z * s - kA * std::sqrt(1.0 - kE2 * s * s);
  return {latitude, portable::atan2(y, x), height};
}

Transform<Ecef, Enu> ecef_from_enu(const Geodetic& origin) {
  const double sb = portable::sin(origin.latitude), cb = portable::cos(origin.latitude);
  const double sl = portable::sin(origin.longitude), cl = portable::cos(origin.longitude);
  Eigen::Matrix3d R;
  R << -sl, -sb * cl, cb * cl,  //
      cl, -sb * sl, cb * sl,    //
      0, cb, sb;
  return {Eigen::Quaterniond(R), to_ecef(origin).xyz};
}

}  // namespace hueline
