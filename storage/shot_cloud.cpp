#include "storage/shot_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <set>
#include <string_view>
#include <vector>

#include "storage/file_writer.hpp"
#include "storage/las_fields.hpp"

namespace hueline::storage {
namespace {

constexpr double kFinestStep_m = 1e-6;
constexpr double kMostSteps = 2147483647.0;
constexpr std::size_t kMostFields = 300;         // each takes 192 bytes in a record of at most 65535
constexpr std::size_t kBytesBuffered = 1 << 20;  // bytes in one write
constexpr int kShotFormat = 7;
const std::string kImageU(las_extra_name<&ColouredPoint::u>()), kImageV(las_extra_name<&ColouredPoint::v>()),
    kState(las_extra_name<&ColouredPoint::state>());

/// Returns whether readers of LAS use the name for something else.
bool is_taken(const std::string& name) {
  static const std::set<std::string> names = {"x",
                                              "y",
                                              "z",
                                              "intensity",
                                              "return_number",
                                              "number_of_returns",
                                              "classification",
                                              "user_data",
                                              "point_source_id",
                                              "scan_angle",
                                              "scan_angle_rank",
                                              "scan_direction_flag",
                                              "edge_of_flight_line",
                                              "scanner_channel",
                                              "synthetic",
                                              "key_point",
                                              "withheld",
                                              "overlap",
                                              "gps_time",
                                              "gpstime",
                                              "red",
                                              "green",
                                              "blue",
                                              "nir",
                                              "infrared",
                                              kImageU,
                                              kImageV,
                                              kState};
  std::string small = name;
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return names.contains(small);
}

LasType las_type(const PcdType& type) {
  if (type.kind == 'F') return type.size == 4 ? LasType::F32 : LasType::F64;
  const bool is_signed = type.kind == 'I';
  switch (type.size) {
    case 1:
      return is_signed ? LasType::I8 : LasType::U8;
    case 2:
      return is_signed ? LasType::I16 : LasType::U16;
    case 4:
      return is_signed ? LasType::I32 : LasType::U32;
    default:
      return is_signed ? LasType::I64 : LasType::U64;
  }
}

/// A field of the cloud and its name in the file.
struct Kept {
  std::span<const double> values;
  LasType type;
};

void append_value(Bytes& out, double value, LasType type) {
  switch (type) {
    case LasType::U8:
      return append(out, static_cast<std::uint8_t>(value));
    case LasType::I8:
      return append(out, static_cast<std::int8_t>(value));
    case LasType::U16:
      return append(out, static_cast<std::uint16_t>(value));
    case LasType::I16:
      return append(out, static_cast<std::int16_t>(value));
    case LasType::U32:
      return append(out, static_cast<std::uint32_t>(value));
    case LasType::I32:
      return append(out, static_cast<std::int32_t>(value));
    case LasType::U64:
      return append(out,
                    value < 0x1p64 ? static_cast<std::uint64_t>(value) : std::numeric_limits<std::uint64_t>::max());
    case LasType::I64:
      return append(out, value < 0x1p63 ? static_cast<std::int64_t>(value) : std::numeric_limits<std::int64_t>::max());
    case LasType::F32:
      return append(out, static_cast<float>(value));
    case LasType::F64:
      return append(out, value);
  }
}

/// Returns the first of these fields that the cloud has.
std::string first_of(const PcdCloud& cloud, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (std::ranges::find(cloud.fields, name) != cloud.fields.end()) return name;
  return {};
}

/// Returns the factor from the cloud's intensity to that of LAS. Drivers give 0 .. 1, bytes or 16 bits, and no PCD says
/// which, so the largest value decides. The exact values are kept as extra bytes.
double intensity_scale(std::span<const double> values) {
  double most = 0;
  for (const double v : values)
    if (std::isfinite(v)) most = std::max(most, v);
  if (most <= 1) return 65535;
  if (most <= 255) return 257;
  return most <= 65535 ? 1 : 65535 / most;
}

/// Chooses offset and step so that every coordinate fits 32 bits: no offset if the cloud lies about its own origin, and
/// the finest possible step.
void choose_steps(const std::array<std::span<const double>, 3>& xyz, std::span<const ShotColour> points,
                  LasHeader& header) {
  double step = kFinestStep_m;
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const ShotColour& p : points)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], xyz[k][p.row]);
      high[k] = std::max(high[k], xyz[k][p.row]);
    }
  for (std::size_t k = 0; k < 3 && !points.empty(); ++k) {
    if (std::max(-low[k], high[k]) >= kMostSteps * kFinestStep_m)
      header.offset[k] = std::floor(low[k] + (high[k] - low[k]) / 2);
    while (std::max(header.offset[k] - low[k], high[k] - header.offset[k]) >= (kMostSteps - 1) * step) step *= 10;
  }
  header.scale.fill(step);
}

/// The extra bytes of the points: how the file describes them, and the values of those that the cloud has.
struct ExtraFields {
  std::vector<LasExtraField> described;  ///< the cloud's fields, then those of the sampled pixel
  std::vector<Kept> kept;                ///< of the cloud's fields
};

/// Gives each field of the cloud except its coordinates a name that is free in LAS.
ExtraFields extra_fields(const PcdCloud& cloud) {
  ExtraFields out;
  std::set<std::string> used = {kImageU, kImageV, kState};
  for (std::size_t f = 0; f < cloud.fields.size(); ++f) {
    const std::string& field = cloud.fields[f];
    if (field == "x" || field == "y" || field == "z" || field == "_") continue;
    const std::string plain = (is_taken(field) ? "cloud_" + field : field).substr(0, 28);
    std::string name = plain;
    for (int again = 2; !used.insert(name).second; ++again) name = fmt::format("{}_{}", plain, again);
    out.described.push_back({name, "as the cloud has it", las_type(cloud.types[f])});
    out.kept.push_back({cloud.columns[f], out.described.back().type});
  }
  out.described.push_back({kImageU, "column that was sampled, px", LasType::F32});
  out.described.push_back({kImageV, "row that was sampled, px", LasType::F32});
  out.described.push_back({kState, "0 coloured 3 uncoloured", LasType::U8});
  return out;
}

/// What a point record needs of the cloud.
struct Columns {
  std::array<std::span<const double>, 3> xyz;
  std::span<const double> intensity, time;  ///< empty if the cloud has none
  double intensity_scale;
};

/// Returns the header of a file with these points. Its bounds are still missing.
LasHeader header_of(const Columns& columns, std::span<const ShotColour> points,
                    const std::vector<LasExtraField>& described, std::size_t record_of_fields_bytes) {
  LasHeader header;
  header.global_encoding = kLasWkt;
  header.system_identifier = header.generating_software = "hueline";
  header.header_size = kLasHeaderSize14;
  header.vlr_count = 1;
  header.point_offset = static_cast<std::uint32_t>(kLasHeaderSize14 + record_of_fields_bytes);
  header.point_format = kShotFormat;
  std::size_t size = las_point_size(kShotFormat);
  for (const LasExtraField& field : described) size += size_of(field.type);
  header.point_size = static_cast<std::uint16_t>(size);
  header.point_count = header.points_by_return[0] = points.size();
  choose_steps(columns.xyz, points, header);
  return header;
}

/// Returns the coordinates of a point in steps of the header.
std::array<std::int32_t, 3> steps_of(const Columns& columns, std::size_t row, const LasHeader& header) {
  std::array<std::int32_t, 3> out;
  for (std::size_t k = 0; k < 3; ++k)
    out[k] = static_cast<std::int32_t>(std::nearbyint((columns.xyz[k][row] - header.offset[k]) / header.scale[k]));
  return out;
}

void append_point(Bytes& out, const std::array<std::int32_t, 3>& steps, const ShotColour& p, const Columns& columns,
                  const std::vector<Kept>& kept) {
  const auto intensity = columns.intensity, time = columns.time;
  for (const std::int32_t step : steps) append(out, step);
  const double strength =
      intensity.empty() || !std::isfinite(intensity[p.row]) ? 0 : intensity[p.row] * columns.intensity_scale;
  append(out, static_cast<std::uint16_t>(std::clamp(std::nearbyint(strength), 0.0, 65535.0)));
  append(out, std::uint8_t{0x11});                           // return 1 of 1
  for (int i = 0; i < 3; ++i) append(out, std::uint8_t{0});  // flags, classification, user data
  append(out, std::int16_t{0});                              // scan angle
  append(out, std::uint16_t{0});                             // point source
  append(out, time.empty() || !std::isfinite(time[p.row]) ? 0.0 : time[p.row]);
  for (const std::uint8_t colour : {p.red, p.green, p.blue}) append(out, static_cast<std::uint16_t>(colour * 257));
  for (const Kept& field : kept) append_value(out, field.values[p.row], field.type);
  append(out, p.u), append(out, p.v), append(out, static_cast<std::uint8_t>(p.state));
}

}  // namespace

std::string intensity_field(const PcdCloud& cloud) {
  constexpr std::string_view kScalar = "scalar_";  // CloudCompare puts this before the names of its fields
  for (const std::string_view wanted : {"intensity", "reflectivity", "reflectance", "remission"})
    for (const std::string& field : cloud.fields) {
      std::string_view name = field;
      if (name.starts_with(kScalar)) name.remove_prefix(kScalar.size());
      if (std::ranges::equal(name, wanted, {}, [](unsigned char c) { return static_cast<char>(std::tolower(c)); }))
        return field;
    }
  return {};
}

Result<ShotCloudNotes> write_shot_cloud(const std::filesystem::path& path, const PcdCloud& cloud,
                                        std::span<const ShotColour> points) {
  const std::array<std::span<const double>, 3> xyz{cloud.column("x"), cloud.column("y"), cloud.column("z")};
  for (const auto& axis : xyz)
    if (axis.empty() && cloud.points() > 0)
      return Error{ErrorCode::Invalid, path.string() + ": the cloud has no fields x, y, z"};

  const ExtraFields fields = extra_fields(cloud);
  if (fields.kept.size() > kMostFields)
    return Error{ErrorCode::Invalid, fmt::format("{}: the cloud has {} fields; LAS can keep {}", path.string(),
                                                 fields.kept.size(), kMostFields)};
  ShotCloudNotes notes;
  notes.intensity_field = intensity_field(cloud);
  const auto intensity = cloud.column(notes.intensity_field);
  if (!notes.intensity_field.empty()) notes.intensity_scale = intensity_scale(intensity);
  notes.time_field = first_of(cloud, {"timestamp", "time_stamp", "time", "gps_time", "t", "offset_time"});
  const Columns columns{xyz, intensity, cloud.column(notes.time_field), notes.intensity_scale};

  Bytes record_of_fields;
  append_vlr(record_of_fields, {"LASF_Spec", 4, "Extra bytes", encode_extra_fields(fields.described)});
  LasHeader header = header_of(columns, points, fields.described, record_of_fields.size());
  notes.step_m = header.scale[0];
  notes.offset_m = header.offset;

  auto file = FileWriter::replace(path);
  if (!file) return file.error();
  Bytes out = encode_las_header(header);
  append(out, record_of_fields);
  std::array<std::int32_t, 3> low, high;
  low.fill(std::numeric_limits<std::int32_t>::max());
  high.fill(std::numeric_limits<std::int32_t>::min());
  for (const ShotColour& p : points) {
    const auto steps = steps_of(columns, p.row, header);
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], steps[k]);
      high[k] = std::max(high[k], steps[k]);
    }
    append_point(out, steps, p, columns, fields.kept);
    if (out.size() < kBytesBuffered) continue;
    if (Status written = file->write(out); !written) return written.error();
    out.clear();
  }
  if (Status written = file->write(out); !written) return written.error();
  for (std::size_t k = 0; k < 3 && !points.empty(); ++k) {
    header.minimum[k] = header.offset[k] + low[k] * header.scale[k];
    header.maximum[k] = header.offset[k] + high[k] * header.scale[k];
  }
  if (Status counted = file->overwrite(0, encode_las_header(header)); !counted) return counted.error();
  if (Status closed = file->close(); !closed) return closed.error();
  return notes;
}

}  // namespace hueline::storage
