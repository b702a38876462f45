#include <string>

#include "products/cloud_export.hpp"
#include "products/laz_file.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {

Result<ExportedCloud> export_laz(const std::filesystem::path& cloud, const std::filesystem::path& out,
                                 const CloudExport& options) {
  auto reader = storage::LasReader::open(cloud);
  if (!reader) return source_error(reader.error());
  const storage::LasHeader& header = reader->header();
  if (!storage::is_laz_record({header.point_format, header.point_size}))
    return Error{ErrorCode::Invalid,
                 cloud.string() + ": points of format " + std::to_string(header.point_format) +
                     " have waveforms, which cannot be written as LAZ here; the profiles ply and e57 leave them out"};
  auto file =
      LazFile::create(out, header, lasting_records(reader->records()), storage::kLazChunkPoints, options.threads);
  if (!file) return file.error();
  ExportedCloud done;
  done.left_out = reader->left_out();
  std::vector<storage::LasPoint> points;
  while (true) {
    const Status read = reader->next(points, storage::kLazChunkPoints);
    if (!read && read.error().code != ErrorCode::Truncated) return source_error(read.error());
    done.source_was_cut = !read;
    if (points.empty()) break;
    storage::Bytes records;
    for (const storage::LasPoint& point : points) {
      storage::append(records, point.record);
      file->count(point);
    }
    if (Status added = file->add(std::move(records)); !added) return added.error();
  }
  if (Status ended = file->end_chunks(); !ended) return ended.error();
  done.points = file->points();
  done.bytes = file->size();
  done.nodes = file->places().size();
  if (Status closed = file->close(); !closed) return closed.error();
  return done;
}

}  // namespace hueline::products
