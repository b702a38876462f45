#include "sim/earth.hpp"

namespace hueline::sim {
namespace {
constexpr double kSemiMajor = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);
}  // namespace

Vec3 ecef_from_geodetic(const GeodeticPlace& g) {
  const double s = std::sin(g.latitude), c = std::cos(g.latitude);
  const double normal = kSemiMajor / std::sqrt(1.0 - kEccentricity2 * s * s);
  return {(normal + g.height) * c * std::cos(g.longitude), (normal + g.height) * c * std::sin(g.longitude),
          (normal * (1.0 - kEccentricity2) + g.height) * s};
}

GeodeticPlace geodetic_from_ecef(Vec3 p) {
  // Fixed-point iteration on tan(latitude) = (z + e2 N sin(latitude)) / rho. Each step reduces the error by e2 (1/150);
  // atan2 keeps it accurate at the poles. The height along the normal uses both components, so that nothing is divided
  // by zero at the equator or at a pole.
  const double rho = std::hypot(p.x, p.y);
  double latitude = std::atan2(p.z, rho * (1.0 - kEccentricity2));
  double normal = kSemiMajor;
  for (int i = 0; i < 12; ++i) {
    const double s = std::sin(latitude);
    normal = kSemiMajor / std::sqrt(1.0 - kEccentricity2 * s * s);
    latitude = std::atan2(p.z + kEccentricity2 * normal * s, rho);
  }
  const double s = std::sin(latitude), c = std::cos(latitude);
  normal = kSemiMajor / std::sqrt(1.0 - kEccentricity2 * s * s);
  const double height = (rho - normal * c) * c + (p.z - normal * (1.0 - kEccentricity2) * s) * s;
  return {latitude, std::atan2(p.y, p.x), height};
}

Mat3 R_ecef_enu(const GeodeticPlace& g) {
  const double sb = std::sin(g.latitude), cb = std::cos(g.latitude);
  const double sl = std::sin(g.longitude), cl = std::cos(g.longitude);
  return {{-sl, -sb * cl, cb * cl, cl, -sb * sl, cb * sl, 0, cb, sb}};
}

}  // namespace hueline::sim
