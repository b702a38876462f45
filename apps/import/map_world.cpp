#include "apps/import/map_world.hpp"

#include <fmt/format.h>

#include <utility>

#include "core/portable_math.hpp"

namespace hueline::apps {
namespace {

/// Says which map is refused. What a rig can say to a map (`cloud.datum`) cannot be said here.
Error map_refused(const std::string& map, const Error& why) {
  return {ErrorCode::Invalid,
          fmt::format("--map {}: {}. Poses are read from projected maps whose datum is that of their positions, as UTM "
                      "on WGS84 or ETRS89: transform those of others first",
                      map, why.message)};
}

}  // namespace

Result<MapWorld> MapWorld::create(const std::string& map, const std::optional<Geodetic>& origin) {
  MapWorld out;
  out.config_.crs = map;
  if (map == "utm" || !out.config_.validate().empty())
    return Error{ErrorCode::Invalid,
                 fmt::format("--map {}: give the EPSG code of the map, with heights of its own or without: EPSG:32632 "
                             "(UTM zone 32 north), EPSG:25832+7837",
                             map)};
  if (!origin) return out;
  auto inverse = storage::MapInverse::create(*origin, out.config_);
  if (!inverse.ok()) return map_refused(map, inverse.error());
  out.zero_ = inverse->map().apply(*origin);
  out.counts_from_origin_ = true;
  out.inverse_.emplace(std::move(*inverse));
  return out;
}

std::optional<drivers::RosPlace> MapWorld::place(const Eigen::Vector3d& coordinates) {
  const std::array<double, 3> position{coordinates.x() + zero_[0], coordinates.y() + zero_[1],
                                       coordinates.z() + zero_[2]};
  if (!inverse_ && status_.ok()) {
    auto inverse = storage::MapInverse::create(position, config_);
    if (inverse.ok())
      inverse_.emplace(std::move(*inverse));
    else
      status_ = map_refused(config_.crs, inverse.error());
  }
  if (!inverse_) return {};
  const auto found = inverse_->apply(position);
  if (!found) return {};
  return drivers::RosPlace{found->place,
                           portable::rotation_about(Eigen::Vector3d::UnitZ(), -found->heading_of_map_north)};
}

drivers::RosWorld MapWorld::world() {
  return {counts_from_origin_ ? drivers::RosMetres::AboutPlace : drivers::RosMetres::OfMap,
          [this](const Eigen::Vector3d& coordinates) { return place(coordinates); }};
}

}  // namespace hueline::apps
