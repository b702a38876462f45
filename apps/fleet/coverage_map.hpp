#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/fleet/catalogue.hpp"

namespace hueline::apps {

/// Drives that belong on one map, because less than 20 km lie between them.
struct CoverageArea {
  std::vector<std::size_t> drives;             ///< numbers in the list of drives, in its order
  double path_m = 0;                           ///< of all
  double latitude_deg = 0, longitude_deg = 0;  ///< of its middle, longitude from -180 to 180
};

/// Returns the areas in which drives were driven, the one with the longest path first. A drive without a place is in
/// none.
std::vector<CoverageArea> coverage_areas(const std::vector<CatalogueEntry>& entries);

/// Returns the map of an area as an <svg>, north up, with a scale. Lines have the class of drive_class() and the
/// drive's name as their title.
std::string coverage_map(const CoverageArea& area, const std::vector<CatalogueEntry>& entries);

/// Returns what class of a line or a row says of a drive: "good", "remarks", "again", or "none" if it has no verdict.
const char* drive_class(const CatalogueEntry& entry);

}  // namespace hueline::apps
