#pragma once

#include <array>

#include "core/geodesy.hpp"

namespace hueline::storage {

/// The transverse Mercator map of UTM, Gauss-Kruger and most national grids, with the same bits on every machine, which
/// PROJ's are not (core/portable_math.hpp). Within 1e-8 m of PROJ up to 15 degrees from the central meridian
/// (transverse_mercator_test). Source: Kruger's series to the sixth order in the third flattening, as in Karney,
/// Transverse Mercator with an accuracy of a few nanometers, Journal of Geodesy 85 (2011), equations 7 to 15 and 35.
/// Immutable.
class TransverseMercator {
 public:
  struct Parameters {
    double semi_major_m = 6378137.0, flattening = 1 / 298.257223563;  ///< of the ellipsoid
    double latitude = 0, longitude = 0;                               ///< of the natural origin, rad
    double scale = 0.9996;                                            ///< on the central meridian
    double easting_m = 500000, northing_m = 0;                        ///< of the natural origin
  };
  explicit TransverseMercator(const Parameters& parameters);
  /// Returns {easting, northing}, m.
  std::array<double, 2> apply(const Geodetic& place) const;

 private:
  /// On the sphere of conformal latitudes: {across, along}, of a radius of 1.
  std::array<double, 2> on_unit(double latitude, double from_meridian) const;

  Parameters p_;
  double eccentricity_, radius_m_;
  std::array<double, 6> series_;
  double along_at_origin_ = 0;
};

}  // namespace hueline::storage
