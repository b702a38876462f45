#pragma once

#include <array>
#include <optional>
#include <string>

#include "core/geodesy.hpp"
#include "core/result.hpp"
#include "storage/map_config.hpp"
#include "storage/proj_context.hpp"
#include "storage/transverse_mercator.hpp"

namespace hueline::storage {

/// What the plane coordinates of a map count.
struct MapUnit {
  const char* name = "m";  ///< behind the name of a column, and in EPSG's own names: "ft", "ftUS"
  double metres = 1;
};
inline constexpr std::array kMapUnits{MapUnit{}, MapUnit{"ft", 0.3048}, MapUnit{"ftUS", 1200.0 / 3937}};

/// The way from the POS's positions to the map, as PROJ finds it. PROJ calculates it too, but for a transverse Mercator
/// map on the positions' own datum: TransverseMercator gives the same bits on every machine. No network and no guess:
/// of the operations that PROJ knows for the place, the most accurate is taken; if that lacks a grid, or is worse than
/// MapConfig::accuracy_m, the map is refused. Move-only. Thread safety: none.
class MapOperation {
 public:
  /// `epoch` is the decimal year of the drive, which counts if MapConfig::epoch is 0. Errors, with a sentence that says
  /// what to do: Invalid if the map, the datum or the geoid cannot be used anywhere; Unsupported if it cannot be used
  /// at `place`; Unavailable if PROJ's database is missing or cannot be read.
  static Result<MapOperation> create(const Geodetic& place, const MapConfig& config, double epoch);

  /// Returns {easting, northing, height}; not finite if the place cannot be shown. Easting and northing count unit(),
  /// the height up_unit().
  std::array<double, 3> apply(const Geodetic& place) const;

  const std::string& crs() const { return crs_; }    ///< "EPSG:25832+7837"
  const std::string& name() const { return name_; }  ///< "ETRS89 / UTM zone 32N + DHHN2016 height"
  const MapUnit& unit() const { return unit_; }
  const MapUnit& up_unit() const { return up_unit_; }  ///< metres, but of a vertical CRS that counts others
  const std::string& wkt() const { return wkt_; }      ///< a COMPD_CS as OGC WKT 1
  /// What was done to the positions, in words: "ETRS89, the map's own datum; ellipsoidal heights".
  const std::string& words() const { return words_; }

 private:
  Status choose(const Geodetic& place, const MapConfig& config, PJ* source, PJ* target);
  std::array<double, 3> apply_proj(const Geodetic& place) const;
  /// Returns how many square metres on the map a square metre on the ground is; less than 0 if the map is a mirror
  /// image.
  double area_at(const Geodetic& place) const;

  ProjContext context_;
  ProjObject to_map_;    // longitude, latitude in degrees, height -> easting, northing, height
  ProjObject to_geoid_;  // longitude, latitude in degrees, height -> the same, above the geoid; null: none
  std::optional<TransverseMercator> transverse_mercator_;  // in place of the plane coordinates of to_map_
  bool has_heights_ = false;                               // to_map_ gives heights
  double epoch_ = 0;
  MapUnit unit_, up_unit_;
  std::string crs_, name_, wkt_, words_;
};

/// Returns the EPSG code of the WGS84 UTM zone at a place, with the exceptions around Norway and Svalbard; from 84
/// degrees north on and beyond 80 degrees south, where UTM ends, that of the polar map UPS (easting, northing).
int utm_epsg(const Geodetic& place);

}  // namespace hueline::storage
