#pragma once

#include "sim/vec3.hpp"

/// The simulator's own WGS84. Angles are in rad, heights above the ellipsoid in m.
namespace hueline::sim {

/// Geodetic coordinates.
struct GeodeticPlace {
  double latitude = 0, longitude = 0, height = 0;
};

/// Returns the ECEF coordinates of a place, m.
Vec3 ecef_from_geodetic(const GeodeticPlace& g);
/// Returns the geodetic coordinates of a place. The iteration ends at the last bit of a double; it converges from the
/// centre of the mantle to orbits, poles included.
GeodeticPlace geodetic_from_ecef(Vec3 p_ecef);
/// Returns the rotation from the local level at `g` into ECEF; its columns are the directions east, north and up.
Mat3 R_ecef_enu(const GeodeticPlace& g);

}  // namespace hueline::sim
