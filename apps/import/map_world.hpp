#pragma once

#include <array>
#include <optional>
#include <string>

#include "core/geodesy.hpp"
#include "core/result.hpp"
#include "drivers/ros/ros_pose.hpp"
#include "storage/map_inverse.hpp"

namespace hueline::apps {

/// The world of poses whose metres are coordinates of a map: x is its east, y its north, and z its height, which is
/// above the ellipsoid if the map has no heights of its own. Positions come out on the map's own datum.
/// Thread safety: none.
class MapWorld {
 public:
  /// `map`: "EPSG:32632", or with heights "EPSG:25832+7837". `origin`: where the coordinates count from; nothing: from
  /// the map's zero. Errors: Invalid, with a sentence that says what to do.
  static Result<MapWorld> create(const std::string& map, const std::optional<Geodetic>& origin);

  /// Returns where coordinates lie, and how the map's axes lie there. The first of them say where the drive is: the map
  /// must be one for this place, or status() says why it is not. Nothing: they are no place.
  std::optional<drivers::RosPlace> place(const Eigen::Vector3d& coordinates);
  const Status& status() const { return status_; }

  /// Returns the world for RosPose. It uses this object, which must stay where it is.
  drivers::RosWorld world();

 private:
  storage::MapConfig config_;
  std::array<double, 3> zero_{};  // the map's coordinates of what the poses count from
  bool counts_from_origin_ = false;
  std::optional<storage::MapInverse> inverse_;
  Status status_;
};

}  // namespace hueline::apps
