#pragma once

#include "core/frames.hpp"

/// WGS84: geodetic <-> ECEF <-> local level.
namespace hueline {

/// WGS84 latitude and longitude in rad, ellipsoidal height in m (never the height above the geoid).
struct Geodetic {
  double latitude = 0, longitude = 0, ellipsoidal_height = 0;
};

Point<Ecef> to_ecef(const Geodetic& g);
/// Bowring's method with one refinement; below 1e-9 m from -5 km to +100 km of height.
Geodetic to_geodetic(const Point<Ecef>& p);

/// Local level at `origin`: columns of the rotation are east, north, up (docs/methods equation 1).
Transform<Ecef, Enu> ecef_from_enu(const Geodetic& origin);

}  // namespace hueline
