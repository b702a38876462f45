#include "drivers/ros/ros_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <memory>
#include <utility>

#include "core/portable_math.hpp"
#include "drivers/ros/packed_points.hpp"

namespace hueline::drivers {
namespace {

struct FieldType {
  const char* name;
  std::size_t bytes;
};
/// The types of sensor_msgs/PointField, by their numbers.
constexpr std::array<FieldType, 9> kTypes{{{"", 0},
                                           {"int8", 1},
                                           {"uint8", 1},
                                           {"int16", 2},
                                           {"uint16", 2},
                                           {"int32", 4},
                                           {"uint32", 4},
                                           {"float32", 4},
                                           {"float64", 8}}};
/// A type of messages. Of a kind that has several, the newest is the first.
struct CloudType {
  const char* type;
  RosCloudKind kind;
};
constexpr CloudType kCloudTypes[]{
    {"sensor_msgs/PointCloud2", RosCloudKind::PointCloud2},
    {"point_cloud_interfaces/CompressedPointCloud2", RosCloudKind::PackedPointCloud2},
    {"sensor_msgs/PointCloud", RosCloudKind::PointCloud},
    {"sensor_msgs/LaserScan", RosCloudKind::LaserScan},
    {"livox_ros_driver2/CustomMsg", RosCloudKind::Livox},
    {"livox_ros_driver/CustomMsg", RosCloudKind::Livox},
    {"livox_interfaces/CustomMsg", RosCloudKind::Livox},
};
constexpr std::uint8_t kUint8 = 2, kUint32 = 6, kFloat32 = 7, kFloat64 = 8;

template <class T>
double read(std::span<const std::byte> bytes, bool is_big_endian) {
  std::byte turned[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i) turned[i] = bytes[is_big_endian ? sizeof(T) - 1 - i : i];
  T value{};
  std::memcpy(&value, turned, sizeof value);
  return static_cast<double>(value);
}

Error malformed_cloud(std::string what) { return {ErrorCode::Malformed, "a point cloud " + std::move(what)}; }

/// `is_packed`: of a CompressedPointCloud2, which is the same with packed points and the name of their format.
Result<RosCloud> take_point_cloud2(RosReader& in, bool is_packed) {
  RosCloud out;
  out.header = in.take_header();
  out.height = in.take<std::uint32_t>();
  out.width = in.take<std::uint32_t>();
  std::vector<RosField> fields;
  const std::uint32_t count = in.take_count(4 + 4 + 1 + 4);
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    RosField field;
    field.name = in.take_string();
    field.offset = in.take<std::uint32_t>();
    field.type = in.take<std::uint8_t>();
    in.take<std::uint32_t>();  // how many values follow each other: the first is used
    fields.push_back(std::move(field));
  }
  out.is_big_endian = in.take<std::uint8_t>() != 0;
  out.point_step = in.take<std::uint32_t>();
  out.row_step = in.take<std::uint32_t>();
  out.data = in.take_byte_sequence();
  if (!in.ok()) return malformed_cloud("that ends before its points do");
  if (is_packed) {
    in.take<std::uint8_t>();  // whether each point has a return
    const std::string format = in.take_string();
    const std::uint64_t row = std::max<std::uint64_t>(out.row_step, std::uint64_t{out.width} * out.point_step);
    // The product of three numbers that a message states may be beyond any whole number.
    const double most = static_cast<double>(row) * static_cast<double>(out.height);
    if (!in.ok() || most > static_cast<double>(kMostPointBytes))
      return malformed_cloud("that ends before its points do");
    auto points = unpacked_points(format, out.data, static_cast<std::size_t>(most));
    if (!points.ok()) return points.error();
    out.computed = std::make_shared<const std::vector<std::byte>>(std::move(*points));
    out.data = *out.computed;
  }
  for (RosField& field : fields)
    if (field.type > 0 && field.type < kTypes.size() && field.offset + kTypes[field.type].bytes <= out.point_step)
      out.fields.push_back(std::move(field));
  if (out.width == 0 || out.height == 0) {
    out.width = out.height = 0;
    return out;
  }
  // Many writers leave the length of the only row wrong.
  const std::uint64_t row = std::uint64_t{out.width} * out.point_step;
  if (out.height == 1) out.row_step = static_cast<std::size_t>(row);
  const bool fits = out.row_step >= row && row <= out.data.size() &&
                    (out.data.size() - row) / std::max<std::size_t>(out.row_step, 1) >= out.height - 1;
  if (out.point_step == 0 || !fits)
    return malformed_cloud(fmt::format("of {} x {} points of {} bytes, {} bytes a row, does not fit into its {} bytes",
                                       out.width, out.height, out.point_step, out.row_step, out.data.size()));
  return out;
}

/// The older kind of cloud: places of float32, and for each further value of the points a list with a name. A list that
/// has not one value for each point says nothing of single points.
Result<RosCloud> take_point_cloud(RosReader& in) {
  constexpr std::size_t kPlace = 3 * sizeof(float);
  struct Channel {
    std::string name;
    std::span<const std::byte> values;
  };
  RosCloud out;
  out.header = in.take_header();
  const std::uint32_t count = in.take_count(kPlace);
  const auto places = in.take_bytes(std::uint64_t{count} * kPlace);
  std::vector<Channel> channels;
  const std::uint32_t channel_count = in.take_count(2 * sizeof(std::uint32_t));
  for (std::uint32_t i = 0; i < channel_count && in.ok(); ++i) {
    Channel one{in.take_string(), {}};
    const std::uint32_t values = in.take_count(sizeof(float));
    one.values = in.take_bytes(std::uint64_t{values} * sizeof(float));
    if (values == count) channels.push_back(std::move(one));
  }
  if (!in.ok()) return malformed_cloud("(sensor_msgs/PointCloud) that ends before its points or their values do");
  out.point_step = kPlace + channels.size() * sizeof(float);
  auto computed = std::make_shared<std::vector<std::byte>>();
  computed->reserve(count * out.point_step);
  const auto append = [&](std::span<const std::byte> from) {
    computed->insert(computed->end(), from.begin(), from.end());
  };
  for (std::size_t i = 0; i < count; ++i) {
    append(places.subspan(i * kPlace, kPlace));
    for (const Channel& one : channels) append(one.values.subspan(i * sizeof(float), sizeof(float)));
  }
  out.fields = {{"x", 0, kFloat32}, {"y", 4, kFloat32}, {"z", 8, kFloat32}};
  for (std::size_t i = 0; i < channels.size(); ++i)
    out.fields.push_back({channels[i].name, static_cast<std::uint32_t>(kPlace + i * sizeof(float)), kFloat32});
  out.is_big_endian = in.is_big_endian();
  out.width = count;
  out.height = count > 0 ? 1 : 0;
  out.row_step = count * out.point_step;
  out.data = *computed;
  out.computed = std::move(computed);
  return out;
}

/// A point of Livox: uint32 offset_time (ns), float32 x, y, z (m), uint8 reflectivity, tag, line.
Result<RosCloud> take_livox(RosReader& in, RosEncoding encoding) {
  constexpr std::size_t kPoint = 19, kAligned = 20;
  RosCloud out;
  out.header = in.take_header();
  const auto base = in.take<std::uint64_t>();
  in.take<std::uint32_t>();  // the number of points, which the sequence repeats
  in.take_bytes(4);          // number of the scanner, reserved
  const std::uint32_t count = in.take_count(kPoint);
  out.point_step = encoding == RosEncoding::Cdr ? kAligned : kPoint;
  out.is_big_endian = in.is_big_endian();
  if (base > 0 && base < std::uint64_t{1} << 62U)
    out.time_base = UnixTime(nanoseconds(static_cast<std::int64_t>(base)));
  out.fields = {{"offset_time", 0, kUint32},  {"x", 4, kFloat32},  {"y", 8, kFloat32},  {"z", 12, kFloat32},
                {"reflectivity", 16, kUint8}, {"tag", 17, kUint8}, {"line", 18, kUint8}};
  // Behind the last point no bytes are needed for the alignment of a next one.
  if (count > 0) out.data = in.take_bytes(std::uint64_t{count - 1} * out.point_step + kPoint);
  if (!in.ok()) return malformed_cloud("of a Livox that ends before its points do");
  out.width = count;
  out.height = count > 0 ? 1 : 0;
  out.row_step = count * out.point_step;
  return out;
}

/// A scan in one plane: angles from x to y, and ranges. What is outside range_min .. range_max is no return.
Result<RosCloud> take_laser_scan(RosReader& in) {
  RosCloud out;
  out.header = in.take_header();
  const auto angle_min = in.take<float>();
  in.take<float>();  // the last angle, which the number of ranges gives
  const auto angle_increment = in.take<float>(), time_increment = in.take<float>();
  in.take<float>();  // from scan to scan
  const auto range_min = in.take<float>(), range_max = in.take<float>();
  const std::uint32_t count = in.take_count(sizeof(float));
  const auto ranges = in.take_bytes(std::uint64_t{count} * sizeof(float));
  const std::uint32_t intensity_count = in.take_count(sizeof(float));
  const auto intensities = in.take_bytes(std::uint64_t{intensity_count} * sizeof(float));
  if (!in.ok()) return malformed_cloud("in one plane (LaserScan) that ends before its ranges do");
  if (!std::isfinite(angle_min) || !std::isfinite(angle_increment) || !std::isfinite(time_increment))
    return malformed_cloud("in one plane (LaserScan) whose angles or times are no numbers");
  struct Computed {
    float x, y, z, intensity;
    double time;
  };
  static_assert(sizeof(Computed) == 24);
  auto computed = std::make_shared<std::vector<std::byte>>(count * sizeof(Computed));
  const auto number = [&](std::span<const std::byte> from, std::size_t i) {
    return static_cast<float>(read<float>(from.subspan(i * sizeof(float)), in.is_big_endian()));
  };
  for (std::size_t i = 0; i < count; ++i) {
    Computed point{0, 0, 0, 0, static_cast<double>(i) * static_cast<double>(time_increment)};
    if (const float range = number(ranges, i); range >= range_min && range <= range_max && std::isfinite(range)) {
      const double angle =
          static_cast<double>(angle_min) + static_cast<double>(i) * static_cast<double>(angle_increment);
      point.x = static_cast<float>(static_cast<double>(range) * portable::cos(angle));
      point.y = static_cast<float>(static_cast<double>(range) * portable::sin(angle));
    }
    if (intensity_count == count) point.intensity = number(intensities, i);
    std::memcpy(computed->data() + i * sizeof point, &point, sizeof point);
  }
  out.fields = {{"x", 0, kFloat32}, {"y", 4, kFloat32}, {"z", 8, kFloat32}};
  if (intensity_count == count) out.fields.push_back({"intensity", 12, kFloat32});
  if (time_increment != 0) out.fields.push_back({"time", 16, kFloat64});
  out.point_step = sizeof(Computed);
  out.width = count;
  out.height = count > 0 ? 1 : 0;
  out.row_step = count * sizeof(Computed);
  out.data = *computed;
  out.computed = std::move(computed);
  return out;
}

}  // namespace

std::optional<RosCloudKind> cloud_kind(std::string_view type) {
  const auto found = std::ranges::find(kCloudTypes, type, &CloudType::type);
  return found == std::end(kCloudTypes) ? std::nullopt : std::optional(found->kind);
}

const char* type_of(RosCloudKind kind) { return std::ranges::find(kCloudTypes, kind, &CloudType::kind)->type; }

const char* word_of(RosCloudKind kind) {
  switch (kind) {
    case RosCloudKind::PointCloud2:
      return "point_cloud2";
    case RosCloudKind::Livox:
      return "livox";
    case RosCloudKind::LaserScan:
      return "laser_scan";
    case RosCloudKind::PackedPointCloud2:
      return "compressed_point_cloud2";
    case RosCloudKind::PointCloud:
      break;
  }
  return "point_cloud";
}

const char* type_name(const RosField& field) { return kTypes[field.type].name; }

const RosField* RosCloud::find(std::string_view name) const {
  const auto found = std::ranges::find(fields, name, &RosField::name);
  return found == fields.end() ? nullptr : &*found;
}

double value_of(const RosCloud& cloud, const RosField& field, std::span<const std::byte> point) {
  const auto bytes = point.subspan(field.offset, kTypes[field.type].bytes);
  switch (field.type) {
    case 1:
      return read<std::int8_t>(bytes, cloud.is_big_endian);
    case 2:
      return read<std::uint8_t>(bytes, cloud.is_big_endian);
    case 3:
      return read<std::int16_t>(bytes, cloud.is_big_endian);
    case 4:
      return read<std::uint16_t>(bytes, cloud.is_big_endian);
    case 5:
      return read<std::int32_t>(bytes, cloud.is_big_endian);
    case 6:
      return read<std::uint32_t>(bytes, cloud.is_big_endian);
    case 7:
      return read<float>(bytes, cloud.is_big_endian);
    default:
      return read<double>(bytes, cloud.is_big_endian);
  }
}

Result<RosCloud> take_cloud(RosCloudKind kind, RosReader message) {
  auto out = kind == RosCloudKind::PointCloud2         ? take_point_cloud2(message, false)
             : kind == RosCloudKind::PackedPointCloud2 ? take_point_cloud2(message, true)
             : kind == RosCloudKind::PointCloud        ? take_point_cloud(message)
             : kind == RosCloudKind::LaserScan         ? take_laser_scan(message)
                                                       : take_livox(message, message.encoding());
  if (!out.ok()) return out.error();
  for (const char* axis : {"x", "y", "z"}) {
    const RosField* field = out->find(axis);
    if (!field || is_whole(*field)) {
      std::string has;
      for (const RosField& one : out->fields)
        has += fmt::format("{}{} {}", has.empty() ? "" : ", ", type_name(one), one.name);
      return Error{ErrorCode::Unsupported,
                   fmt::format("a point cloud without x, y and z as float32 or float64; it has {}",
                               has.empty() ? "no fields" : has)};
    }
  }
  return out;
}

}  // namespace hueline::drivers
