#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "storage/cloud_parts.hpp"

namespace hueline::storage {

/// The name of the index in the folder of the parts.
constexpr const char* kPartIndex = "index.geojson";

/// Writes the index of the parts as GeoJSON (RFC 7946): a rectangle for each part, in longitude and latitude on the
/// datum of the cloud's CRS, with its file, number of points, bounds and times. Returns how many parts have no
/// rectangle: all without a CRS, and with one that is neither projected nor geographic; those whose coordinates are no
/// places of the CRS. Errors: Io; Unavailable if PROJ's database cannot be read.
Result<std::size_t> write_part_index(const std::filesystem::path& path, const std::vector<CloudPart>& parts,
                                     const std::string& wkt);

}  // namespace hueline::storage
