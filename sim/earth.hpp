#pragma once

#include "sim/vec3.hpp"

/// WGS84, the simulator's own. Angles in rad, heights above the ellipsoid in m.
namespace hueline::sim {

struct GeodeticPlace {
  double latitude = 0, longitude = 0, height = 0;
};

Vec3 ecef_from_geodetic(const GeodeticPlace& g);
/// Iterated to the last bit of double; good from the centre of the mantle to orbit, poles included.
GeodeticPlace geodetic_from_ecef(Vec3 p_ecef);
/// Columns: east, north, up at `g`.
Mat3 R_ecef_enu(const GeodeticPlace& g);

}  // namespace hueline::sim
