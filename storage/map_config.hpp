#pragma once

#include <string>

#include "core/keys.hpp"

namespace hueline::storage {

/// The map of a cloud, and the datum of the positions that come into it.
struct MapConfig {
  /// "utm" (the WGS84 zone of the drive's origin; UPS near the poles), "EPSG:n" (a projected CRS in metres or feet, or
  /// a compound one with its own heights) or "EPSG:n+m" (a projected CRS and a vertical one).
  std::string crs = "utm";
  /// The CRS of the POS's positions, "EPSG:n", a geographic one; empty: the one of the map's own datum.
  std::string datum{};
  double epoch = 0;         ///< of the POS's positions, decimal year; 0: the time of the drive
  double accuracy_m = 0.1;  ///< largest stated error of an operation between datums
  std::string geoid{};      ///< file of a grid of geoid heights; empty: heights are those of `crs`

  void visit(Keys& keys);
  KeyError validate() const;
  bool operator==(const MapConfig&) const = default;
};

}  // namespace hueline::storage
