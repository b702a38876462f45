#include "products/cloud_split.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "products/laz_file.hpp"
#include "products/point_upgrade.hpp"
#include "products/points_at_once.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {
namespace {

using storage::CloudPart;
using storage::CloudParts;
using storage::CloudSplit;
using storage::LasPoint;
using storage::LasReader;

/// Calls use(points) for pieces of the cloud until it is read, or until `use` returns an error. Returns whether the
/// cloud was cut.
template <class Use>
Result<bool> for_each_piece(LasReader& reader, const Use& use) {
  reader.rewind();
  bool was_cut = false;
  for (std::vector<LasPoint> points;;) {
    const Status read = reader.next(points, kPointsAtOnce);
    if (!read && read.error().code != ErrorCode::Truncated) return source_error(read.error());
    was_cut = was_cut || !read;
    if (points.empty()) return was_cut;
    if (Status used = use(points); !used) return used.error();
  }
}

/// Counts the tiles of a cloud, if its bounds leave it open whether there are too many. Errors: Invalid if there are;
/// those of reading.
Status count_tiles(LasReader& reader, const CloudSplit& split, double edge) {
  const storage::LasHeader& header = reader.header();
  double most = 1;
  for (const std::size_t axis : {0, 1}) most *= (header.maximum[axis] - header.minimum[axis]) / edge + 2;
  // A header without bounds, or with wrong ones, leaves it open too.
  if (most > 0 && most <= static_cast<double>(CloudParts::kMostTiles)) return {};
  std::set<std::pair<std::int64_t, std::int64_t>> tiles;
  const Result<bool> read = for_each_piece(reader, [&](const std::vector<LasPoint>& points) -> Status {
    for (const LasPoint& point : points) {
      tiles.emplace(static_cast<std::int64_t>(std::floor(point.x / edge)),
                    static_cast<std::int64_t>(std::floor(point.y / edge)));
      if (tiles.size() > CloudParts::kMostTiles) return CloudParts::too_many_tiles(split);
    }
    return {};
  });
  return read ? Status() : read.error();
}

/// Writes each part again as COPC.
Status make_octrees(const std::filesystem::path& folder, std::vector<CloudPart>& parts, const CloudExport& options) {
  for (CloudPart& part : parts) {
    const std::filesystem::path whole = folder / part.file;
    part.file.replace_extension().replace_extension(".copc.laz");
    const auto made = export_copc(whole, folder / part.file, options);
    std::error_code error;
    std::filesystem::remove(whole, error);
    if (!made) return made.error();
    part.bytes = made->bytes;
  }
  return {};
}

}  // namespace

Result<SplitCloud> split_cloud(const std::filesystem::path& cloud, const std::filesystem::path& folder,
                               const CloudSplit& split, const std::vector<GpsTime>& ends, bool is_copc,
                               const CloudExport& options) {
  auto reader = LasReader::open(cloud);
  if (!reader) return source_error(reader.error());
  if (is_copc)
    if (const auto upgrade = PointUpgrade::create(*reader); !upgrade)
      return Error{upgrade.error().code, cloud.string() + ": " + upgrade.error().message};
  CloudParts::Config config;
  config.split = split;
  config.header = reader->header();
  config.records = lasting_records(reader->records());
  config.threads = options.threads;
  if (is_copc) config.ending = storage::kBeforeOctree;
  if (!split.is_strips()) {
    const Result<storage::CrsUnit> unit = storage::crs_unit(*reader);
    if (!unit) return unit.error();
    if (unit->is_angle)
      return Error{ErrorCode::Unsupported,
                   cloud.string() + ": its coordinates are longitude and latitude; tiles are squares of a map"};
    config.tile_edge = split.size / unit->metres;
    if (Status counted = count_tiles(*reader, split, config.tile_edge); !counted) return counted.error();
  } else {
    const Result<bool> read = for_each_piece(*reader, [&](const std::vector<LasPoint>& points) -> Status {
      for (const LasPoint& point : points)
        if (const auto time = reader->gps_time(point))
          config.earliest = std::min(config.earliest.value_or(*time), *time);
      return {};
    });
    if (!read) return read.error();
  }
  const Result<std::size_t> unfinished = storage::remove_parts(folder, storage::EarlierParts::Unfinished);
  if (!unfinished) return unfinished.error();
  auto parts = CloudParts::create(folder, std::move(config));
  if (!parts) return parts.error();
  for (const GpsTime end : ends) parts->end_strip(end);
  const Result<bool> was_cut = for_each_piece(*reader, [&](const std::vector<LasPoint>& points) -> Status {
    for (const LasPoint& point : points)
      if (Status added = parts->add(point.record); !added) return added;
    return {};
  });
  const Status finished = parts->finish();
  if (!was_cut) return was_cut.error();
  if (!finished) return finished.error();
  SplitCloud done{parts->parts(), *was_cut, *unfinished};
  if (done.parts.empty() && *was_cut) return Error{ErrorCode::Truncated, "the cloud ends before its first point"};
  if (done.parts.empty()) return Error{ErrorCode::EndOfData, "the cloud has no points: there is nothing to export"};
  if (is_copc)
    if (Status made = make_octrees(folder, done.parts, options); !made) return made.error();
  return done;
}

}  // namespace hueline::products
