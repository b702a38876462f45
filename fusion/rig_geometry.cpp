#include "fusion/rig_geometry.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "core/mounting.hpp"

namespace hueline::fusion {
namespace {

/// A closed polygon as files write it.
struct PolygonKeys {
  std::vector<double> polygon_px;

  void visit(Keys& keys) {
    keys.numbers(required("polygon_px", "px", "`[u, v, u, v, ...]`: the corners, three or more."), polygon_px,
                 {-100000, 100000});
  }
  KeyError validate() const {
    if (polygon_px.size() < 6 || polygon_px.size() % 2)
      return not_allowed("polygon_px", fmt::format("a list of {}", polygon_px.size()), "u, v of three corners or more");
    return {};
  }
};

void visit_polygons(Keys& keys, const Key& key, std::vector<Polygon>& polygons) {
  std::vector<PolygonKeys> described;
  if (!keys.list(key, described)) return;
  polygons.clear();
  for (const PolygonKeys& one : described) {
    Polygon& polygon = polygons.emplace_back();
    for (std::size_t i = 0; i < one.polygon_px.size(); i += 2)
      polygon.emplace_back(one.polygon_px[i], one.polygon_px[i + 1]);
  }
}

template <class To, class From>
KeyError check_transform(const char* key, const Transform<To, From>& transform, double farthest_m) {
  if (!transform.translation.allFinite() || !transform.rotation.coeffs().allFinite())
    return {key, "has a value that is not a number"};
  if (std::abs(transform.rotation.norm() - 1.0) > 1e-6) return {key, "has a rotation that is not of unit length"};
  if (transform.translation.norm() > farthest_m)
    return {key, fmt::format("has a lever arm of {} m; allowed: 0 to {} m", number_text(transform.translation.norm()),
                             number_text(farthest_m))};
  return {};
}

KeyError check_polygons(const char* key, const std::vector<Polygon>& polygons) {
  for (const Polygon& polygon : polygons) {
    if (polygon.size() < 3)
      return {key, fmt::format("has a polygon of {} corners; allowed: 3 or more", polygon.size())};
    for (const auto& corner : polygon)
      if (!corner.allFinite()) return {key, "has a corner that is not a number"};
  }
  return {};
}

}  // namespace

void LaserMount::visit(Keys& keys) {
  keys.number({"sigma_range_m", "m", "One standard deviation of a range."}, sigma_range_m, {0, 10, Ends::MinOnly});
  visit_transform(keys,
                  required("T_body_scanner", "",
                           "Where the scanner sits: a [mounting](#mountings), at most 50 m from the body's origin."),
                  T_body_scanner);
}

KeyError LaserMount::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  return check_transform("T_body_scanner", T_body_scanner, 50.0);
}

void LensMount::visit(Keys& keys) {
  keys.text(required("name", "", "The lens's name, for people. Its place in the list is its number in `cloud.las`."),
            name);
  keys.text(required("camera", "", "The name of the camera, a sensor of this rig, whose image holds the lens image."),
            camera_name);
  std::array<std::uint32_t, 2> offset{x_offset, y_offset};
  if (keys.wholes(required("offset_px", "px", "Column and row of the lens image's first pixel in that image."), offset,
                  {0, 100'000})) {
    x_offset = offset[0];
    y_offset = offset[1];
  }
  visit_transform(
      keys,
      required("T_head_lens", "", "Where the lens sits: a [mounting](#mountings), at most 5 m from the head's origin."),
      T_head_lens);
  intrinsics.visit(keys);
  keys.duration({"row_time_us", "us",
                 "Rolling shutter: the time from one row of the lens image to the next; negative if the last row is "
                 "exposed first. The exposure's time is that of the middle row. 0: all rows are exposed at once."},
                row_time, {-1000, 1000});
  visit_polygons(
      keys,
      {"masks", "", "Parts of the vehicle and dirt, in pixels of the lens image. Pixels inside them give no colour.",
       "none"},
      masks);
}

KeyError LensMount::validate() const {
  if (KeyError wrong = intrinsics.validate(); !wrong.empty()) return wrong;
  if (KeyError wrong = check_transform("T_head_lens", T_head_lens, 5.0); !wrong.empty()) return wrong;
  if (x_offset > 100'000 || y_offset > 100'000)
    return not_allowed("offset_px", fmt::format("[{}, {}]", x_offset, y_offset), "0 to 100000 px");
  return check_polygons("masks", masks);
}

void PanoramaShape::visit(Keys& keys) {
  keys.whole(required("width", "px", "The width of the panorama."), width, {16, 65535});
  keys.whole(required("height", "px", "The height of the panorama."), height, {8, 65535});
  keys.number({"forward_column", "px", "The column of the head's +x. It is below width - 0.5.", "(width - 1) / 2"},
              forward_column, {-0.5, 100'000});
  keys.flag({"clockwise", "", "Whether columns grow clockwise seen from above."}, is_clockwise);
  keys.number(required("stitching_radius_m", "m",
                       "The radius of the sphere on which the lens images were joined. Every lens lies inside it."),
              stitching_radius_m, {0.5, 10'000});
}

KeyError PanoramaShape::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (!(forward() >= -0.5 && forward() < width - 0.5))
    return not_allowed("forward_column", number_text(forward()),
                       fmt::format("-0.5 to below {} px", number_text(width - 0.5)));
  return {};
}

void CameraHeadGeometry::visit(Keys& keys) {
  visit_transform(keys,
                  required("T_body_head", "",
                           "Where the head sits: a [mounting](#mountings), at most 50 m from the body's origin."),
                  T_body_head);
  keys.angle(
      {"nadir_half_angle_deg", "deg", "The half angle of the cap around the head's -z in which no image is used."},
      nadir_half_angle, {0, 85});
  keys.section(required("panorama", "", "The panorama that the method `panorama` uses."), panorama);
  visit_polygons(
      keys,
      {"panorama_masks", "", "The vehicle, in pixels of the panorama. Only the method `panorama` uses it.", "none"},
      panorama_masks);
  keys.list(required("lenses", "", "The lenses of the head."), lenses, {1, 32});
}

KeyError CameraHeadGeometry::validate() const {
  if (KeyError wrong = check_transform("T_body_head", T_body_head, 50.0); !wrong.empty()) return wrong;
  if (lenses.empty() || lenses.size() > kMostLenses)
    return not_allowed("lenses", fmt::format("a list of {}", lenses.size()), "1 to 32 lenses");
  for (std::size_t i = 0; i < lenses.size(); ++i) {
    if (KeyError wrong = lenses[i].validate(); !wrong.empty()) return wrong.inside(fmt::format("lenses[{}]", i));
    if (lenses[i].T_head_lens.translation.norm() >= panorama.stitching_radius_m)
      return KeyError{"stitching_radius_m",
                      fmt::format("is {}; allowed: beyond every lens, and lens {} ({}) lies outside that sphere",
                                  number_text(panorama.stitching_radius_m), i, lenses[i].name)}
          .inside("panorama");
  }
  if (!(nadir_half_angle >= 0 && nadir_half_angle < 1.5))
    return not_allowed("nadir_half_angle_deg", number_text(nadir_half_angle * 180 / std::numbers::pi), "0 to 85 deg");
  if (KeyError wrong = check_polygons("panorama_masks", panorama_masks); !wrong.empty()) return wrong;
  return panorama.validate().inside("panorama");
}

std::string RigGeometry::validate() const {
  std::set<SensorId> seen;
  for (const LaserMount& laser : lasers) {
    if (!seen.insert(laser.sensor).second) return fmt::format("laser {} is listed twice", laser.sensor);
    if (KeyError wrong = laser.validate(); !wrong.empty())
      return fmt::format("laser {}: {}", laser.sensor, wrong.text());
  }
  // Without a camera, points are placed and stay without a colour.
  return head.lenses.empty() ? std::string() : head.validate().text();
}

}  // namespace hueline::fusion
