#include "storage/e57_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "storage/e57_reader.hpp"
#include "storage/pcd_header.hpp"

namespace hueline::storage {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// A field of E57 and its name in a cloud. `invalid` names the field that says where its values are not valid.
struct FieldName {
  std::string_view e57, cloud, invalid;
};
constexpr std::array<FieldName, 12> kFieldNames{{{"intensity", "intensity", "isIntensityInvalid"},
                                                 {"colorRed", "red", "isColorInvalid"},
                                                 {"colorGreen", "green", "isColorInvalid"},
                                                 {"colorBlue", "blue", "isColorInvalid"},
                                                 {"timeStamp", "time_stamp", "isTimeStampInvalid"},
                                                 {"nor:normalX", "normal_x", ""},
                                                 {"nor:normalY", "normal_y", ""},
                                                 {"nor:normalZ", "normal_z", ""},
                                                 {"rowIndex", "row", ""},
                                                 {"columnIndex", "column", ""},
                                                 {"returnIndex", "return_index", ""},
                                                 {"returnCount", "return_count", ""}}};
/// The fields that become x, y and z, or say where values are not valid.
constexpr std::array<std::string_view, 11> kUsedFields{
    "cartesianX",         "cartesianY",       "cartesianZ",         "cartesianInvalidState",
    "sphericalRange",     "sphericalAzimuth", "sphericalElevation", "sphericalInvalidState",
    "isIntensityInvalid", "isColorInvalid",   "isTimeStampInvalid"};

const FieldName* field_name(std::string_view e57) {
  const auto found = std::ranges::find(kFieldNames, e57, &FieldName::e57);
  return found == kFieldNames.end() ? nullptr : &*found;
}

/// Returns how a cloud stores the values of a column.
PcdType type_of(const E57Column& column) {
  if (column.kind == E57Column::Kind::Float32) return {'F', 4};
  if (column.kind == E57Column::Kind::Float64 || column.scale != 1 || column.offset != 0) return {'F', 8};
  using I32 = std::numeric_limits<std::int32_t>;
  if (column.minimum >= 0) {
    for (const std::size_t size : {1, 2, 4})
      if (column.maximum < std::int64_t{1} << (8 * size)) return {'U', size};
  } else if (column.minimum >= I32::min() && column.maximum <= I32::max()) {
    return {'I', 4};
  }
  return {'F', 8};
}

/// Names the columns of the cloud: those of all scans. Error: Unsupported beyond kMostPcdColumns.
Status name_columns_of(const std::string& name, const std::vector<E57Scan>& scans, PcdCloud& cloud) {
  cloud.fields = {"x", "y", "z"};
  cloud.types = {{'F', 8}, {'F', 8}, {'F', 8}};
  for (const E57Scan& scan : scans)
    for (const E57Column& column : scan.columns) {
      if (std::ranges::find(kUsedFields, column.name) != kUsedFields.end()) continue;
      const FieldName* known = field_name(column.name);
      const std::string field(known ? known->cloud : std::string_view(column.name));
      const PcdType type = type_of(column);
      const auto at = std::ranges::find(cloud.fields, field);
      if (at == cloud.fields.end()) {
        if (cloud.fields.size() == kMostPcdColumns)
          return Error{ErrorCode::Unsupported,
                       fmt::format("{}: its scans have more than {} different fields", name, kMostPcdColumns)};
        cloud.fields.push_back(field);
        cloud.types.push_back(type);
      } else if (PcdType& kept = cloud.types[static_cast<std::size_t>(at - cloud.fields.begin())];
                 kept.kind != type.kind || kept.size != type.size) {
        kept = {'F', 8};
      }
    }
  // Whole numbers have no word for "none".
  for (std::size_t i = 3; i < cloud.fields.size(); ++i)
    for (const E57Scan& scan : scans) {
      const auto known = std::ranges::find(kFieldNames, cloud.fields[i], &FieldName::cloud);
      const std::string_view e57 = known == kFieldNames.end() ? std::string_view(cloud.fields[i]) : known->e57;
      const bool may_lack = !scan.column(e57) || (known != kFieldNames.end() && scan.column(known->invalid));
      if (may_lack && cloud.types[i].kind != 'F') cloud.types[i] = {'F', 8};
    }
  cloud.columns.resize(cloud.fields.size());
  return {};
}

/// Appends points of a scan to the cloud.
void append_points(const E57Scan& scan, const std::vector<std::vector<double>>& columns,
                   const std::vector<Point<Scanner>>& places, PcdCloud& cloud) {
  for (const Point<Scanner>& place : places)
    for (std::size_t axis = 0; axis < 3; ++axis)
      cloud.columns[axis].push_back(place.xyz[static_cast<Eigen::Index>(axis)]);
  for (std::size_t i = 3; i < cloud.fields.size(); ++i) {
    const auto known = std::ranges::find(kFieldNames, cloud.fields[i], &FieldName::cloud);
    const auto from = scan.column(known == kFieldNames.end() ? std::string_view(cloud.fields[i]) : known->e57);
    const auto invalid = known == kFieldNames.end() ? std::nullopt : scan.column(known->invalid);
    for (std::size_t k = 0; k < places.size(); ++k)
      cloud.columns[i].push_back(!from || (invalid && columns[*invalid][k] != 0) ? kNoValue : columns[*from][k]);
  }
}

bool have_one_pose(const std::vector<E57Scan>& scans) {
  constexpr double kSamePlace_m = 1e-9, kSameTurn = 1e-12;
  return std::ranges::all_of(scans, [&](const E57Scan& scan) {
    const auto difference = scans.front().T_world_scanner.inverse() * scan.T_world_scanner;
    return difference.translation.norm() <= kSamePlace_m && difference.rotation.vec().norm() <= kSameTurn;
  });
}

using TakePoints = std::function<Status(const E57Scan&, const std::vector<std::vector<double>>& columns,
                                        const std::vector<Point<Scanner>>& places)>;

/// Gives all points of a file to `take`. `prepare` sees the scans before.
Status read_all_scans(const std::filesystem::path& path,
                      const std::function<Status(const std::vector<E57Scan>&)>& prepare, const TakePoints& take) {
  auto reader = E57Reader::open(path);
  if (!reader.ok()) return reader.error();
  const std::vector<E57Scan>& scans = reader->scans();
  const bool has_points = std::ranges::any_of(scans, [](const E57Scan& scan) { return scan.points > 0; });
  if (!has_points) return Error{ErrorCode::Malformed, path.string() + ": this E57 has no points"};
  if (!have_one_pose(scans))
    return Error{ErrorCode::Unsupported,
                 fmt::format("{}: its {} scans were taken from different places, and each is in its scanner's frame: "
                             "write the scan that is meant into a file of its own",
                             path.string(), scans.size())};
  if (Status prepared = prepare(scans); !prepared.ok()) return prepared;
  std::vector<std::vector<double>> columns;
  std::vector<Point<Scanner>> places;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (Status begun = reader->begin(i); !begun.ok()) return begun;
    for (;;) {
      if (Status read = reader->next(columns); !read.ok()) return read;
      e57_places(scans[i], columns, places);
      if (places.empty()) break;
      if (Status taken = take(scans[i], columns, places); !taken.ok()) return taken;
    }
  }
  return {};
}

}  // namespace

Result<PcdCloud> read_e57_cloud(const std::filesystem::path& path) {
  PcdCloud cloud;
  const Status read = read_all_scans(
      path, [&](const std::vector<E57Scan>& scans) { return name_columns_of(path.string(), scans, cloud); },
      [&](const E57Scan& scan, const auto& columns, const auto& places) -> Status {
        if (cloud.points() > kMostCloudValues / cloud.fields.size()) return too_many_cloud_values(path.string());
        append_points(scan, columns, places, cloud);
        return {};
      });
  if (!read.ok()) return read.error();
  return cloud;
}

Status read_e57_places(const std::filesystem::path& path, const std::function<void(const Point<Scanner>&)>& take) {
  std::size_t taken = 0;
  return read_all_scans(
      path, [](const std::vector<E57Scan>&) { return Status(); },
      [&](const E57Scan&, const auto&, const auto& places) -> Status {
        if (taken > kMostCloudValues / 3) return too_many_cloud_values(path.string());
        for (const Point<Scanner>& place : places)
          if (place.xyz.allFinite()) {
            take(place);
            ++taken;
          }
        return {};
      });
}

}  // namespace hueline::storage
