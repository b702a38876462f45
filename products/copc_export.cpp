#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "products/cloud_export.hpp"
#include "products/laz_file.hpp"
#include "products/point_upgrade.hpp"
#include "products/points_at_once.hpp"
#include "storage/copc_format.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {
namespace {

using storage::LasPoint;
using storage::PointOctree;

Status add_nodes(LazFile& file, PointOctree& tree) {
  for (storage::Bytes& records : tree.take())
    if (Status added = file.add(std::move(records)); !added) return added;
  return {};
}

}  // namespace

Result<ExportedCloud> export_copc(const std::filesystem::path& cloud, const std::filesystem::path& out,
                                  const CloudExport& options) {
  auto reader = storage::LasReader::open(cloud);
  if (!reader) return source_error(reader.error());
  Result<PointUpgrade> upgrade = PointUpgrade::create(*reader);
  if (!upgrade) return Error{upgrade.error().code, cloud.string() + ": " + upgrade.error().message};
  const storage::LasHeader& header = upgrade->header();
  std::vector<LasPoint> points;
  Status read = reader->next(points, kPointsAtOnce);
  const auto is_wrong = [&read] { return !read && read.error().code != ErrorCode::Truncated; };
  if (is_wrong()) return source_error(read.error());
  if (points.empty() && !read) return read.error();
  if (points.empty()) return Error{ErrorCode::EndOfData, cloud.string() + " has no points: there is nothing to export"};
  std::vector<storage::LasVlr> records = upgrade->records();
  records.insert(records.begin(), storage::copc_info_vlr());
  auto file = LazFile::create(out, header, records, storage::kLazVariableChunks, options.threads);
  if (!file) return file.error();

  PointOctree tree({header.scale, header.point_size, options.node_points, options.held_bytes, out.parent_path()});
  std::pair<double, double> times{std::numeric_limits<double>::max(), std::numeric_limits<double>::lowest()};
  while (!points.empty()) {
    for (const LasPoint& point : points) {
      if (Status added = tree.add((*upgrade)(point.record)); !added) return added.error();
      file->count(point);
      const double time = point.time.value_or(0);
      if (std::isnan(time)) continue;
      times.first = std::min(times.first, time);
      times.second = std::max(times.second, time);
    }
    if (Status added = add_nodes(*file, tree); !added) return added.error();
    read = reader->next(points, kPointsAtOnce);
    if (is_wrong()) return source_error(read.error());
  }
  for (bool has_more = true; has_more;) {
    const Result<bool> finished = tree.finish_some();
    if (!finished) return finished.error();
    has_more = *finished;
    if (Status added = add_nodes(*file, tree); !added) return added.error();
  }
  if (Status ended = file->end_chunks(); !ended) return ended.error();
  if (times.first > times.second) times = {0, 0};  // no point has a time that is a number

  const storage::CopcHierarchy hierarchy = storage::encode_copc_hierarchy(tree.nodes(), file->places(), file->size());
  file->header().evlr_offset = file->size();
  file->header().evlr_count = 1;
  if (Status written = file->append(hierarchy.record); !written) return written.error();
  if (Status written =
          file->overwrite(storage::kCopcInfoPlace, storage::encode_copc_info(tree.cube(), header, hierarchy, times));
      !written)
    return written.error();
  ExportedCloud done{file->points(), file->size(), file->places().size(), !read.ok(), reader->left_out()};
  if (Status closed = file->close(); !closed) return closed.error();
  return done;
}

}  // namespace hueline::products
