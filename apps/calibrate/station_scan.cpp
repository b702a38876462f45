#include "apps/calibrate/station_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace hueline::apps {
namespace {

constexpr double kFarthestReturn_m = 10'000;  // of static scanners

/// Returns the distance of the nearest return of the first block that has one; nothing if none has.
Result<std::optional<double>> nearest_in_first_block(const storage::ScanFile& scan) {
  std::vector<std::byte> scratch;
  for (std::size_t i = 0; i < scan.blocks(); ++i) {
    const auto xyz = scan.block(i, scratch);
    if (!xyz.ok()) return xyz.error();
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < xyz->size(); k += 3) {
      const double x = (*xyz)[k], y = (*xyz)[k + 1], z = (*xyz)[k + 2], squared = x * x + y * y + z * z;
      if (squared > 0) nearest = std::min(nearest, squared);
    }
    if (std::isfinite(nearest)) return std::optional(std::sqrt(nearest));
  }
  return std::optional<double>();
}

}  // namespace

Result<StationScan> open_station_scan(const std::filesystem::path& path,
                                      const std::optional<storage::ScanFormat>& format,
                                      const calibration::SurveyedStation& station) {
  auto file = storage::ScanFile::open(path, format);
  if (!file.ok()) return file.error();
  const auto nearest = nearest_in_first_block(*file);
  if (!nearest.ok()) return nearest.error();
  const std::string words = fmt::format("{} ({})", path.string(), file->layout().words);
  if (nearest->value_or(0) <= kFarthestReturn_m) return StationScan{std::move(*file), {}, words};

  const Eigen::Vector3d& place = station.position.xyz;
  const std::array<double, 3> origin{place.x(), place.y(), place.z()};
  auto moved = storage::ScanFile::open(path, format, origin);
  if (!moved.ok()) return moved.error();
  const auto nearest_moved = nearest_in_first_block(*moved);
  if (!nearest_moved.ok()) return nearest_moved.error();
  if (nearest_moved->value_or(0) > kFarthestReturn_m)
    return Error{
        ErrorCode::Invalid,
        fmt::format("{}: its points begin {:.0f} m from 0 0 0 and {:.0f} m from station {}: a scan is wanted in "
                    "the scanner's frame or in the coordinates of the stations",
                    path.string(), **nearest, **nearest_moved, station.name)};
  return StationScan{std::move(*moved), origin,
                     fmt::format("{}, coordinates of a map, counted from the station's place {:.4f} {:.4f} {:.4f}",
                                 words, origin[0], origin[1], origin[2])};
}

}  // namespace hueline::apps
