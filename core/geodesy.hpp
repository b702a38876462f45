#pragma once

#include "core/frames.hpp"

/// Conversions between geodetic coordinates, ECEF and the local level, on the WGS84 ellipsoid.
namespace hueline {

/// WGS84 latitude and longitude in rad, and the ellipsoidal height in m (never the height above the geoid).
struct Geodetic {
  double latitude = 0, longitude = 0, ellipsoidal_height = 0;
};

/// Returns whether latitude and longitude are angles of a place, and the height is below 100 km: what a device sends
/// before it knows its place often is not.
bool is_on_earth(const Geodetic& g);

/// Returns the ECEF position of a geodetic one.
Point<Ecef> to_ecef(const Geodetic& g);
/// Returns the geodetic position of an ECEF one, by Bowring's method with one refinement. The error is below 1e-9 m for
/// heights from -5 km to +100 km.
Geodetic to_geodetic(const Point<Ecef>& p);

/// Returns the transform from the local level at `origin` to ECEF. The columns of its rotation are east, north and up
/// (docs/methods, equation 1).
Transform<Ecef, Enu> ecef_from_enu(const Geodetic& origin);

}  // namespace hueline
