#pragma once

#include <filesystem>
#include <vector>

#include "core/time.hpp"
#include "products/cloud_export.hpp"
#include "storage/cloud_parts.hpp"

/// Writes a finished cloud in parts: strips of the drive, or tiles of the map.
namespace hueline::products {

/// What was written.
struct SplitCloud {
  std::vector<storage::CloudPart> parts;
  bool source_was_cut = false;  ///< the cloud ended before its header says: what is whole was written
  /// Files of parts that a run before this one, which was killed, had left unfinished in the folder.
  std::size_t unfinished_removed = 0;
};

/// Writes a LAS or LAZ cloud of the point formats that can be compressed as LAZ files in `folder`, or as COPC if
/// `is_copc`. Every point comes into one part (storage/cloud_parts.hpp), in the order of the cloud, and a part's header
/// describes that part.
///
/// The cloud is read once; for strips it is read once more before, to find its earliest time, and for tiles so small
/// that there may be more than CloudParts::kMostTiles, to count them before one is written. `ends` are the times at
/// which each strip but the last ends, for CloudSplit::Kind::Distance. Errors: those of export_laz(), export_copc() and
/// CloudParts; EndOfData if the cloud has no points; Unsupported if tiles are asked for and its coordinates are
/// longitudes and latitudes.
Result<SplitCloud> split_cloud(const std::filesystem::path& cloud, const std::filesystem::path& folder,
                               const storage::CloudSplit& split, const std::vector<GpsTime>& ends, bool is_copc,
                               const CloudExport& options);

}  // namespace hueline::products
