#pragma once

#include <Eigen/Core>
#include <string>

#include "core/result.hpp"
#include "storage/las_reader.hpp"

namespace hueline::storage {

/// What a step of 1 along x or y of a cloud is.
struct CrsUnit {
  double metres = 1;      ///< its length, if it is one
  bool is_angle = false;  ///< the coordinates are longitude and latitude
};

/// Returns the unit of a cloud's CRS, by its WKT or its GeoTIFF keys. Without a CRS, and for one that PROJ does not
/// know, it is the metre. Error: Unavailable if PROJ's database cannot be read. Thread safety: one thread per cloud.
/// Source: LAS 1.4 R15 (coordinate reference system records); GeoTIFF 1.1 (OGC 19-008r4).
Result<CrsUnit> crs_unit(const LasReader& cloud);
/// Returns the unit of a CRS that is given as WKT. Error: that of crs_unit().
Result<CrsUnit> crs_unit(const std::string& wkt);

/// Returns a cloud's CRS as WKT (OGC 01-009): its record, what PROJ knows of the EPSG numbers in its GeoTIFF keys, or
/// the projection that the keys describe themselves (GeoKeys::own_projection()). Empty if it has none of these. Error
/// and thread safety: those of crs_unit().
Result<std::string> crs_wkt(const LasReader& cloud);

/// Returns whether a cloud's GeoTIFF keys describe a CRS that crs_wkt() does not know. Error: that of crs_unit().
Result<bool> has_unread_crs(const LasReader& cloud);

/// What makes metres of a cloud's coordinates.
struct CrsInMetres {
  double metres = 1;     ///< of a step of 1 along x or y
  double up_metres = 1;  ///< of a step of 1 along z: that of the vertical CRS, or without one that of x and y
  std::string wkt;       ///< the CRS that counts in metres; empty if it is not known

  Eigen::Vector3d place(const LasPoint& p) const { return {p.x * metres, p.y * metres, p.z * up_metres}; }
};

/// Returns how to count a cloud's coordinates in metres. A CRS in metres stays as crs_wkt() has it. Errors: those of
/// crs_unit(); Invalid if the coordinates are longitude and latitude. Thread safety: that of crs_unit().
Result<CrsInMetres> crs_in_metres(const LasReader& cloud);

}  // namespace hueline::storage
