#pragma once

#include <array>
#include <optional>
#include <utility>

#include "core/geodesy.hpp"
#include "core/result.hpp"
#include "storage/map_config.hpp"
#include "storage/map_operation.hpp"

namespace hueline::storage {

/// A position of a map, on the earth.
struct MapPlace {
  Geodetic place{};
  double heading_of_map_north = 0;  ///< the meridian convergence: rad from true north, clockwise
};

/// The way back from coordinates of a map to positions. It iterates MapOperation, so what a cloud of the same MapConfig
/// gets for the result is the coordinates that were given. Move-only. Thread safety: none.
class MapInverse {
 public:
  /// `position`: {easting, northing, height} of any place of the drive. Errors: those of MapOperation::create(), and
  /// Invalid if the map has no such place.
  static Result<MapInverse> create(const std::array<double, 3>& position, const MapConfig& config);
  /// `near`: any place of the drive. Errors: those of MapOperation::create().
  static Result<MapInverse> create(const Geodetic& near, const MapConfig& config);

  /// Returns the place of {easting, northing, height}, within 1e-6 m of its coordinates; nothing if the map has no such
  /// place near that of the drive.
  std::optional<MapPlace> apply(const std::array<double, 3>& position) const;
  const MapOperation& map() const { return map_; }

 private:
  MapInverse(const Geodetic& near, MapOperation map) : near_(near), map_(std::move(map)) {}

  Geodetic near_;
  MapOperation map_;
};

}  // namespace hueline::storage
