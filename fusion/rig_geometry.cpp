#include "fusion/rig_geometry.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>

namespace hueline::fusion {
namespace {

template <class To, class From>
std::string check_transform(const char* key, const Transform<To, From>& transform, double farthest_m) {
  if (!transform.translation.allFinite() || !transform.rotation.coeffs().allFinite()) {
    return fmt::format("{} has a value that is not a number", key);
  }
  if (std::abs(transform.rotation.norm() - 1.0) > 1e-6) return fmt::format("{} has a rotation that is not of unit length", key);
  if (transform.translation.norm() > farthest_m) {
    return fmt::format("{} has a lever arm of {} m; allowed: 0 to {} m", key, transform.translation.norm(), farthest_m);
  }
  return {};
}

std::string check_polygons(const char* key, const std::vector<Polygon>& polygons) {
  for (const Polygon& polygon : polygons) {
    if (polygon.size() < 3) return fmt::format("{} has a polygon of {} corners; allowed: 3 or more", key, polygon.size());
    for (const auto& corner : polygon) {
      if (!corner.allFinite()) return fmt::format("{} has a corner that is not a number", key);
    }
  }
  return {};
}

std::string check_lens(const LensMount& lens) {
  if (std::string why = lens.intrinsics.validate(); !why.empty()) return why;
  if (std::string why = check_transform("T_head_lens", lens.T_head_lens, 5.0); !why.empty()) return why;
  if (lens.x_offset > 1000000 || lens.y_offset > 1000000) return "x_offset, y_offset: allowed: 0 to 1000000 px";
  return check_polygons("masks", lens.masks);
}

}  // namespace

std::string PanoramaShape::validate() const {
  if (width < 16 || width > 65535) return fmt::format("panorama width is {}; allowed: 16 to 65535 px", width);
  if (height < 8 || height > 65535) return fmt::format("panorama height is {}; allowed: 8 to 65535 px", height);
  if (!(forward_column >= -0.5 && forward_column < width - 0.5)) {
    return fmt::format("forward_column is {}; allowed: -0.5 to width - 0.5 px", forward_column);
  }
  if (!(stitching_radius_m >= 0.5 && stitching_radius_m <= 1e6)) {
    return fmt::format("stitching_radius_m is {}; allowed: 0.5 to 1000000 m", stitching_radius_m);
  }
  return {};
}

std::string CameraHeadGeometry::validate() const {
  if (std::string why = check_transform("T_body_head", T_body_head, 50.0); !why.empty()) return why;
  if (lenses.empty() || lenses.size() > 32) return fmt::format("lenses has {} entries; allowed: 1 to 32", lenses.size());
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    if (std::string why = check_lens(lenses[i]); !why.empty()) return fmt::format("lens {} ({}): {}", i, lenses[i].name, why);
    if (lenses[i].T_head_lens.translation.norm() >= panorama.stitching_radius_m) {
      return fmt::format("stitching_radius_m is {}; lens {} ({}) lies outside that sphere", panorama.stitching_radius_m, i,
                         lenses[i].name);
    }
  }
  if (!(nadir_half_angle >= 0 && nadir_half_angle < 1.5)) {
    return fmt::format("nadir_half_angle is {}; allowed: 0 to 1.5 rad", nadir_half_angle);
  }
  if (std::string why = check_polygons("panorama_masks", panorama_masks); !why.empty()) return why;
  return panorama.validate();
}

std::string RigGeometry::validate() const {
  std::set<SensorId> seen;
  for (const LaserMount& laser : lasers) {
    if (!seen.insert(laser.sensor).second) return fmt::format("laser {} is listed twice", laser.sensor);
    if (std::string why = check_transform("T_body_scanner", laser.T_body_scanner, 50.0); !why.empty()) {
      return fmt::format("laser {}: {}", laser.sensor, why);
    }
    if (!(laser.sigma_range_m >= 0 && laser.sigma_range_m < 10)) {
      return fmt::format("laser {}: sigma_range_m is {}; allowed: 0 to 10 m", laser.sensor, laser.sigma_range_m);
    }
  }
  // A rig without a camera places points and leaves them uncoloured.
  return head.lenses.empty() ? std::string() : head.validate();
}

}  // namespace hueline::fusion
