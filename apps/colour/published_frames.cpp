#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>

#include "apps/colour/published_calibration.hpp"
#include "apps/colour/published_lens.hpp"
#include "apps/colour/yaml_numbers.hpp"
#include "config/section.hpp"

/// Poses in YAML that say between which frames they are.
namespace hueline::apps {
namespace {

bool names_one_of(const std::string& frame, std::initializer_list<const char*> words) {
  const std::string lower = lower_case(frame);
  for (const char* word : words)
    if (lower.find(word) != std::string::npos) return true;
  return false;
}
bool is_laser(const std::string& frame) {
  return names_one_of(frame, {"lidar", "laser", "velo", "ouster", "os1", "os0", "os2", "livox", "hesai", "pandar",
                              "robosense", "rslidar", "cloud"});
}
/// A camera may be called by its lens alone, as front_6mm.
bool may_be_camera(const std::string& frame) {
  return names_one_of(frame, {"cam", "lens", "optical"}) ||
         (!is_laser(frame) && !names_one_of(frame, {"novatel", "imu", "ins", "gnss", "gps", "base", "body", "ego",
                                                    "vehicle", "world", "map", "odom", "utm", "radar"}));
}

/// Reads members of a mapping. Throws config::ConfigError if one is missing.
Numbers members(const std::string& path, const YAML::Node& node, const char* what,
                std::initializer_list<const char*> keys) {
  Numbers out;
  for (const char* key : keys) {
    if (!node.IsMap() || !node[key]) throw config::ConfigError(fmt::format("{}: {} has no {}", path, what, key));
    out.push_back(number_of<double>(node[key]));
  }
  return out;
}

/// Takes the pose of frame `child` in frame `parent`.
void take_pose(const std::string& path, const std::string& parent, const std::string& child, const YAML::Node& rotation,
               const YAML::Node& translation, ShotCalibration& out) {
  const Numbers q = members(path, rotation, "the rotation", {"w", "x", "y", "z"}),
                t = members(path, translation, "the translation", {"x", "y", "z"});
  const Eigen::Quaterniond R(q[0], q[1], q[2], q[3]);
  if (!(std::abs(R.norm() - 1) < 1e-3))
    throw config::ConfigError(fmt::format("{}: the rotation is a quaternion of length {:.4g}, not 1", path, R.norm()));
  const Transform<Lens, Scanner> found{R.normalized(), {t[0], t[1], t[2]}};
  const bool is_from_laser = is_laser(child) && may_be_camera(parent),
             is_from_camera = is_laser(parent) && may_be_camera(child);
  if (is_from_laser == is_from_camera)
    throw config::ConfigError(fmt::format(
        "{}: holds the pose of {} in the frame of {}, and these names do not say that one is a laser and the other a "
        "camera. If they are, write it as T_lens_scanner (docs/colour.md)",
        path, child, parent));
  out.T_lens_scanner = is_from_laser ? found : turned_round(found);
  if (is_from_camera)
    out.pose_note =
        fmt::format("{}: is the pose of the camera ({}) in the frame of the laser ({}), and was turned round\n", path,
                    child, parent);
}

}  // namespace

bool read_framed_pose(const std::string& path, const YAML::Node& root, ShotCalibration& out) {
  const YAML::Node header = root["header"], child = root["child_frame_id"], transform = root["transform"];
  if (header && header.IsMap() && header["frame_id"] && child && child.IsScalar() && transform && transform.IsMap() &&
      transform["rotation"] && transform["translation"]) {
    take_pose(path, header["frame_id"].as<std::string>(), child.Scalar(), transform["rotation"],
              transform["translation"], out);
    return true;
  }
  for (const auto& member : root) {
    const YAML::Node& pose = member.second;
    if (!member.first.IsScalar() || !pose.IsMap() || !pose["q"] || !pose["t"]) continue;
    const std::string& name = member.first.Scalar();
    const auto between = name.find('-');
    if (between == std::string::npos) continue;
    take_pose(path, name.substr(0, between), name.substr(between + 1), pose["q"], pose["t"], out);
    return true;
  }
  return false;
}

}  // namespace hueline::apps
