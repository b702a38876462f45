#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "products/cloud_export.hpp"
#include "products/e57_file.hpp"
#include "products/points_at_once.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {
namespace {

using storage::LasPoint;

/// Returns the earliest time of a cloud's points, as stored, infinity if none has one, and begins the cloud again.
/// It is not the first point's where the points stand in the order of an octree.
Result<double> earliest_time(storage::LasReader& reader) {
  double out = std::numeric_limits<double>::infinity();
  std::vector<LasPoint> points;
  while (true) {
    const Status read = reader.next(points, kPointsAtOnce);
    if (!read && read.error().code != ErrorCode::Truncated) return source_error(read.error());
    for (const LasPoint& p : points)
      if (const double time = p.time.value_or(out); time < out) out = time;
    if (!read || points.empty()) break;
  }
  reader.rewind();
  return out;
}

}  // namespace

Result<ExportedCloud> export_e57(const std::filesystem::path& cloud, const std::filesystem::path& out,
                                 const std::string& software) {
  auto reader = storage::LasReader::open(cloud);
  if (!reader) return source_error(reader.error());
  E57Scan scan;
  scan.name = cloud.stem().string();
  scan.software = software;
  const Result<storage::CrsInMetres> crs = storage::crs_in_metres(*reader);
  if (!crs) return Error{crs.error().code, cloud.string() + ": " + crs.error().message};
  scan.crs = crs->wkt;
  scan.has_colour = reader->has_colour();
  scan.has_intensity = true;
  // The standard counts times from the scan's beginning, and none is before it.
  const bool may_have_time = (reader->header().global_encoding & storage::kLasAdjustedTime) != 0;
  const Result<double> first = may_have_time ? earliest_time(*reader) : std::numeric_limits<double>::infinity();
  if (!first) return first.error();
  const bool has_time = std::isfinite(*first);
  using Type = E57Field::Type;
  std::vector<E57Field> fields{{"cartesianX", Type::Double}, {"cartesianY", Type::Double}, {"cartesianZ", Type::Double},
                               {"intensity", Type::U16},     {"returnIndex", Type::U8},    {"returnCount", Type::U8}};
  if (scan.has_colour)
    fields.insert(fields.end(), {{"colorRed", Type::U8}, {"colorGreen", Type::U8}, {"colorBlue", Type::U8}});
  if (has_time) fields.push_back({"timeStamp", Type::Double});
  const Result<bool> has_byte_colours = reader->has_byte_colours();
  if (!has_byte_colours) return has_byte_colours.error();
  auto file = E57File::create(out, fields);
  if (!file) return file.error();
  scan.minimum.fill(std::numeric_limits<double>::infinity());
  scan.maximum.fill(-std::numeric_limits<double>::infinity());
  ExportedCloud done;
  std::vector<LasPoint> points;
  storage::Bytes bytes;
  double last = *first;
  while (true) {
    const Status read = reader->next(points, kPointsAtOnce);
    if (!read && read.error().code != ErrorCode::Truncated) return source_error(read.error());
    done.source_was_cut = !read;
    if (points.empty()) break;
    for (const LasPoint& p : points) {
      bytes.clear();
      const std::array<double, 3> place{p.x * crs->metres, p.y * crs->metres, p.z * crs->up_metres};
      for (std::size_t i = 0; i < 3; ++i) {
        scan.minimum[i] = std::min(scan.minimum[i], place[i]);
        scan.maximum[i] = std::max(scan.maximum[i], place[i]);
        storage::append(bytes, place[i]);
      }
      storage::append(bytes, p.intensity);
      // Counted from 0 here.
      storage::append(bytes, static_cast<std::uint8_t>(p.return_number > 0 ? p.return_number - 1 : 0));
      storage::append(bytes, p.return_count);
      if (scan.has_colour)
        for (const std::uint16_t one : {p.red, p.green, p.blue})
          storage::append(bytes, static_cast<std::uint8_t>(*has_byte_colours ? one : one >> 8));
      if (has_time) {
        const double time = p.time.value_or(*first);
        last = std::max(last, time);
        storage::append(bytes, time - *first);
      }
      if (Status written = file->add(bytes); !written) return written.error();
    }
  }
  constexpr double kAdjustment_s = 1e9;  // of adjusted standard GPS time
  if (has_time && file->points() > 0) {
    scan.begin_s = *first + kAdjustment_s;
    scan.end_s = last + kAdjustment_s;
  }
  done.points = file->points();
  done.nodes = 1;
  if (Status closed = file->close(scan); !closed) return closed.error();
  done.bytes = file->size();
  return done;
}

}  // namespace hueline::products
