#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "products/cloud_export.hpp"
#include "products/ply_file.hpp"
#include "products/points_at_once.hpp"
#include "storage/cloud_crs.hpp"
#include "storage/las_reader.hpp"

namespace hueline::products {
namespace {

using storage::LasExtraField;
using storage::LasPoint;
using storage::LasType;

/// PLY has neither whole numbers of 64 bits nor scales.
bool is_number_as_it_is(const LasExtraField& field) {
  return !field.has_scale && field.type != LasType::U64 && field.type != LasType::I64;
}

/// Names in a PLY header end at white space.
std::string one_word(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !(c > ' ' && c < '\x7f'); }, '_');
  return name.empty() ? "unnamed" : name;
}

}  // namespace

Result<ExportedCloud> export_ply(const std::filesystem::path& cloud, const std::filesystem::path& out) {
  auto reader = storage::LasReader::open(cloud);
  if (!reader) return source_error(reader.error());
  const bool has_colour = reader->has_colour();
  const bool has_time = reader->header().point_format != 0 && reader->header().point_format != 2;
  std::vector<PlyProperty> properties{{"x", LasType::F64}, {"y", LasType::F64}, {"z", LasType::F64}};
  if (has_colour)
    properties.insert(properties.end(), {{"red", LasType::U8}, {"green", LasType::U8}, {"blue", LasType::U8}});
  properties.insert(properties.end(), {{"intensity", LasType::U16},
                                       {"return_number", LasType::U8},
                                       {"return_count", LasType::U8},
                                       {"classification", LasType::U8},
                                       {"sensor", LasType::U16}});
  if (has_time) properties.push_back({"time", LasType::F64});
  for (const LasExtraField& field : reader->extra_fields())
    properties.push_back({one_word(field.name), is_number_as_it_is(field) ? field.type : LasType::F64});
  std::vector<std::string> comments{"x y z: easting, northing, height in the CRS below"};
  if (has_time)
    comments.emplace_back(reader->header().global_encoding & storage::kLasAdjustedTime
                              ? "time: GPS seconds - 1e9 (adjusted standard GPS time)"
                              : "time: GPS seconds of the week");
  Result<std::string> wkt = storage::crs_wkt(*reader);
  if (!wkt) return wkt.error();
  if (!wkt->empty()) {
    std::replace_if(
        wkt->begin(), wkt->end(), [](char c) { return c == '\n' || c == '\r' || c == '\0'; }, ' ');
    comments.push_back("crs " + *wkt);
  }
  const Result<bool> has_byte_colours = reader->has_byte_colours();
  if (!has_byte_colours) return has_byte_colours.error();
  auto file = PlyFile::create(out, comments, properties, reader->available());
  if (!file) return file.error();
  ExportedCloud done;
  std::vector<LasPoint> points;
  storage::Bytes bytes;
  while (true) {
    const Status read = reader->next(points, kPointsAtOnce);
    if (!read && read.error().code != ErrorCode::Truncated) return source_error(read.error());
    done.source_was_cut = !read;
    if (points.empty()) break;
    bytes.clear();
    for (const LasPoint& p : points) {
      for (const double one : {p.x, p.y, p.z}) storage::append(bytes, one);
      if (has_colour)
        for (const std::uint16_t one : {p.red, p.green, p.blue})
          storage::append(bytes, static_cast<std::uint8_t>(*has_byte_colours ? one : one >> 8));
      storage::append(bytes, p.intensity);
      for (const std::uint8_t one : {p.return_number, p.return_count, p.classification}) storage::append(bytes, one);
      storage::append(bytes, p.source);
      if (has_time) storage::append(bytes, p.time.value_or(std::nan("")));
      for (const LasExtraField& field : reader->extra_fields())
        if (is_number_as_it_is(field))
          storage::append(bytes, p.record.subspan(field.offset, storage::size_of(field.type)));
        else
          storage::append(bytes, storage::LasReader::extra(p, field));
    }
    if (Status written = file->add(bytes); !written) return written.error();
    done.points += points.size();
  }
  done.bytes = file->size();
  done.nodes = 1;
  if (Status closed = file->close(); !closed) return closed.error();
  return done;
}

}  // namespace hueline::products
