#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/result.hpp"
#include "storage/las_reader.hpp"

namespace hueline::storage {

/// The GeoTIFF keys by which a LAS file of before 1.4 says its CRS (records 34735 and 34736 of LASF_Projection; OGC
/// 19-008r4). Their numbers and the values that are used here:
enum class GeoKey : std::uint16_t {
  ModelType = 1024,  ///< 1 projected, 2 geographic, 3 geocentric
  GeographicCrs = 2048,
  Datum = 2050,
  AngularUnit = 2054,
  Ellipsoid = 2056,
  SemiMajorAxis = 2057,
  InverseFlattening = 2059,
  PrimeMeridian = 2061,
  ProjectedCrs = 3072,
  ProjectionMethod = 3075,
  LinearUnit = 3076,
  LinearUnitSize = 3077,
  VerticalCrs = 4096,
  VerticalUnit = 4099,
};

constexpr std::uint16_t kGeoUserDefined = 32767;  ///< a number that says: other keys define it

class GeoKeys {
 public:
  explicit GeoKeys(const LasReader& cloud);
  /// Returns a value that is in the directory itself; 0 if the key is not there.
  std::uint16_t operator[](GeoKey key) const;
  /// Returns a value among the doubles.
  std::optional<double> number(std::uint16_t key) const;

  bool is_geographic() const { return (*this)[GeoKey::ModelType] == 2; }
  /// Returns EPSG:number of the horizontal CRS; empty if the keys do not name one.
  std::string horizontal_crs() const;
  /// Returns whether the keys describe a projection of their own.
  bool has_own_projection() const;
  /// Returns that projection as WKT; empty if there is none, or if it is none of Transverse Mercator, Lambert's
  /// conformal conic (one or two standard parallels), Albers and Mercator. Lengths are in the unit of the coordinates,
  /// as the standard says. Error: Unavailable if PROJ's database could not be read. Thread safety: a context for each
  /// call.
  Result<std::string> own_projection() const;

 private:
  std::map<std::uint16_t, std::uint16_t> values_;
  std::map<std::uint16_t, double> numbers_;
};

/// Returns how many metres a unit has: the metre, the foot (9002) or the US survey foot (9003); nothing for others.
std::optional<double> metres_of_unit(std::uint16_t unit);

}  // namespace hueline::storage
