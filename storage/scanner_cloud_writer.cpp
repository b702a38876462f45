#include "storage/scanner_cloud_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/calendar.hpp"

namespace hueline::storage {
namespace {

constexpr double kResolution_m = 0.0001;
constexpr std::size_t kBuffered = 1 << 20;  // bytes in one write
constexpr int kFormat = 6;
/// Room for the number of points in the header of a PCD file, which is known at the end.
constexpr int kDigits = 12;

const std::vector<LasExtraField>& extra_fields() {
  static const std::vector<LasExtraField> fields{{"channel", "laser channel", LasType::U16},
                                                 {"azimuth", "of the firing, rad", LasType::F32},
                                                 {"range", "m", LasType::F32}};
  return fields;
}

}  // namespace

ScannerCloudWriter::ScannerCloudWriter(FileWriter file, const Config& config)
    : file_(std::move(file)), config_(config) {
  header_.global_encoding = static_cast<std::uint16_t>(kLasWkt | (config.has_gps_time ? kLasAdjustedTime : 0));
  header_.system_identifier = config.scanner.substr(0, 32);
  header_.generating_software = "hueline";
  header_.creation_year = config.created.year;
  header_.creation_day = day_of_year(config.created);
  header_.header_size = kLasHeaderSize14;
  header_.vlr_count = 2;
  header_.point_format = kFormat;
  header_.scale = {kResolution_m, kResolution_m, kResolution_m};
  std::size_t size = las_point_size(kFormat);
  for (const LasExtraField& field : extra_fields()) size += size_of(field.type);
  header_.point_size = static_cast<std::uint16_t>(size);
  lowest_.fill(std::numeric_limits<std::int32_t>::max());
  highest_.fill(std::numeric_limits<std::int32_t>::min());
}

/// Returns what stands before the points. Its length does not depend on their number.
Bytes ScannerCloudWriter::head() const {
  Bytes out;
  if (config_.format == Format::Pcd) {
    // Many readers look for "count " in any letters and take what follows for the numbers of values, so no field before
    // the last has a name that ends so.
    storage::append(
        out, as_bytes(fmt::format("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
                                  "# {}\n# time: {}\n"
                                  "FIELDS x y z intensity time ring azimuth range return_number return_count\n"
                                  "SIZE 4 4 4 1 8 2 4 4 1 1\n"
                                  "TYPE F F F U F U F F U U\n"
                                  "COUNT 1 1 1 1 1 1 1 1 1 1\n"
                                  "WIDTH {:<{}}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {:<{}}\nDATA binary\n",
                                  config_.scanner, config_.clock, header_.point_count, kDigits, header_.point_count,
                                  kDigits)));
    return out;
  }
  Bytes records;
  append_vlr(records, {"LASF_Spec", 4, "Extra bytes", encode_extra_fields(extra_fields())});
  append_vlr(records, {"LASF_Spec", 3, "Text", config_.scanner + "; time: " + config_.clock});
  LasHeader header = header_;
  header.point_offset = static_cast<std::uint32_t>(kLasHeaderSize14 + records.size());
  for (std::size_t axis = 0; axis < 3 && header.point_count > 0; ++axis) {
    header.minimum[axis] = lowest_[axis] * kResolution_m;
    header.maximum[axis] = highest_[axis] * kResolution_m;
  }
  out = encode_las_header(header);
  storage::append(out, records);
  return out;
}

Result<ScannerCloudWriter> ScannerCloudWriter::create(const std::filesystem::path& path, const Config& config) {
  auto file = FileWriter::replace(path);
  if (!file.ok()) return file.error();
  ScannerCloudWriter writer(std::move(file).value(), config);
  if (Status done = writer.file_.write(writer.head()); !done.ok()) return done.error();
  return writer;
}

void ScannerCloudWriter::append_las(const ScannerPoint& point) {
  const LaserReturn& r = point.laser;
  const std::array<float, 3> place{r.x, r.y, r.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // A range of any scanner fits: 32 bits hold 214 km.
    const auto steps = static_cast<std::int32_t>(
        std::clamp(std::nearbyint(static_cast<double>(place[axis]) / kResolution_m), -2147483647.0, 2147483647.0));
    lowest_[axis] = std::min(lowest_[axis], steps);
    highest_[axis] = std::max(highest_[axis], steps);
    storage::append(buffer_, steps);
  }
  const auto count = std::min<std::uint8_t>(15, r.return_count);
  const auto number = std::clamp<std::uint8_t>(r.return_number, 1, 15);
  storage::append(buffer_, static_cast<std::uint16_t>(r.reflectivity * 257));
  storage::append(buffer_, static_cast<std::uint8_t>(number | count << 4));
  for (int i = 0; i < 3; ++i) storage::append(buffer_, std::uint8_t{0});  // flags, classification, user data
  storage::append(buffer_, std::int16_t{0});                              // scan angle
  storage::append(buffer_, std::uint16_t{0});                             // point source
  storage::append(buffer_, point.time_s);
  storage::append(buffer_, r.channel);
  storage::append(buffer_, r.azimuth);
  storage::append(buffer_, r.range_m);
  ++header_.points_by_return[number - 1u];
}

void ScannerCloudWriter::append_pcd(const ScannerPoint& point) {
  const LaserReturn& r = point.laser;
  for (const float place : {r.x, r.y, r.z}) storage::append(buffer_, place);
  storage::append(buffer_, r.reflectivity);
  storage::append(buffer_, point.time_s);
  storage::append(buffer_, r.channel);
  storage::append(buffer_, r.azimuth);
  storage::append(buffer_, r.range_m);
  storage::append(buffer_, r.return_number);
  storage::append(buffer_, r.return_count);
}

Status ScannerCloudWriter::append(std::span<const ScannerPoint> points) {
  for (const ScannerPoint& point : points) {
    config_.format == Format::Las ? append_las(point) : append_pcd(point);
    if (buffer_.size() < kBuffered) continue;
    if (Status done = file_.write(buffer_); !done.ok()) return done;
    buffer_.clear();
  }
  header_.point_count += points.size();
  return {};
}

Status ScannerCloudWriter::close() {
  if (Status done = file_.write(buffer_); !done.ok()) return done;
  buffer_.clear();
  if (Status done = file_.overwrite(0, head()); !done.ok()) return done;
  return file_.close();
}

}  // namespace hueline::storage
