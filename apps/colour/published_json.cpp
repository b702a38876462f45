#include "apps/colour/published_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "apps/colour/published_lens.hpp"
#include "config/section.hpp"

namespace hueline::apps {
namespace {

using PlainJson = nlohmann::json;

/// Reads a number, or the numbers in lists. What is neither is left out, so the matrix has too few.
Numbers flat(const PlainJson& value, int depth = kDeepest) {
  if (value.is_number()) return {value.get<double>()};
  Numbers out;
  if (!value.is_array() || depth == 0) return out;
  for (const auto& one : value) {
    const Numbers inner = flat(one, depth - 1);
    out.insert(out.end(), inner.begin(), inner.end());
  }
  return out;
}

void read_sensors_calibration(const std::string& path, const PlainJson& param, ShotCalibration& out) {
  if (param.contains("cam_K")) {
    PublishedLens lens{.K = flat(param.at("cam_K").at("data")),
                       .distortion = flat(param.at("cam_dist").at("data")),
                       .model = {},
                       .width = param.value("img_dist_w", 0U),
                       .height = param.value("img_dist_h", 0U)};
    if (lens.distortion.size() < 4 || lens.distortion.size() > 5)
      throw config::ConfigError(path + ": cam_dist needs 4 or 5 numbers");
    take_lens(lens, path, "cam_K", out);
  }
  if (param.contains("sensor_calib"))
    out.T_lens_scanner = pose_of(flat(param.at("sensor_calib").at("data")), path + ": the rotation of sensor_calib");
}

/// The form of direct_visual_lidar_calibration: the pose is that of the camera in the laser's frame, x y z qx qy qz qw.
void read_direct_visual(const std::string& path, const PlainJson& root, ShotCalibration& out) {
  const PlainJson& camera = root.at("camera");
  const Numbers focal = flat(camera.at("intrinsics"));
  const std::string model = lower_case(camera.value("camera_model", ""));
  check_model(path, model);
  if (focal.size() != 4) throw config::ConfigError(path + ": camera.intrinsics needs fx, fy, cx and cy");
  take_lens({.K = camera_matrix(focal), .distortion = flat(camera.at("distortion_coeffs")), .model = model}, path,
            "camera.intrinsics", out);
  const auto results = root.find("results");
  if (results == root.end() || !results->contains("T_lidar_camera")) return;
  const Numbers v = flat(results->at("T_lidar_camera"));
  const Eigen::Quaterniond q =
      v.size() == 7 ? Eigen::Quaterniond(v[6], v[3], v[4], v[5]) : Eigen::Quaterniond(0, 0, 0, 0);
  if (std::abs(q.norm() - 1) > 1e-3)
    throw config::ConfigError(path + ": T_lidar_camera needs x, y, z and a quaternion qx, qy, qz, qw of length 1");
  out.T_lens_scanner = turned_round({q.normalized(), {v[0], v[1], v[2]}});
}

/// Reads K, D and T by these names.
bool read_k_d_t(const std::string& path, const PlainJson& root, ShotCalibration& out) {
  const bool has_lens = root.contains("K"), has_pose = root.contains("T");
  if (has_lens) {
    const auto first = [&root](std::initializer_list<const char*> keys) {
      for (const char* key : keys)
        if (root.contains(key)) return root.at(key);
      return PlainJson();
    };
    PublishedLens lens{.K = flat(root.at("K")), .distortion = {}, .model = {}};
    for (const char* key : kDistortionKeys)
      if (root.contains(key)) {
        lens.distortion = flat(root.at(key));
        check_distortion(path, key, lens.distortion, root.at(key).is_array() && root.at(key).empty());
      }
    if (const PlainJson model = first(kLooseModelKeys); model.is_string())
      lens.model = loose_model(model.get<std::string>());
    if (const PlainJson model = first(kModelKeys); model.is_string()) lens.model = lower_case(model.get<std::string>());
    if (const PlainJson width = first(kWidthKeys); width.is_number_unsigned()) lens.width = width.get<std::uint32_t>();
    if (const PlainJson height = first(kHeightKeys); height.is_number_unsigned())
      lens.height = height.get<std::uint32_t>();
    take_lens(lens, path, "K", out);
  }
  if (has_pose) out.T_lens_scanner = pose_of(flat(root.at("T")), path + ": T");
  return has_lens || has_pose;
}

/// Reads `intrinsic` and `extrinsic` of SUSTechPOINTS, cam_K and cam_D of DAIR-V2X, and `tf` of HITSZ's calibrator,
/// which has K and D in `cam`.
bool read_bare_matrices(const std::string& path, const PlainJson& root, ShotCalibration& out) {
  bool is_known = false;
  for (const auto& [K, D] : {std::pair{"intrinsic", "distortion"}, std::pair{"cam_K", "cam_D"}}) {
    if (!root.contains(K)) continue;
    PublishedLens lens{.K = flat(root.at(K)), .distortion = {}, .model = {}};
    if (root.contains(D)) {
      lens.distortion = flat(root.at(D));
      check_distortion(path, D, lens.distortion, root.at(D).is_array() && root.at(D).empty());
    }
    take_lens(lens, path, K, out);
    is_known = true;
  }
  for (const char* T : {"extrinsic", "tf"}) {
    if (!root.contains(T)) continue;
    out.T_lens_scanner = pose_of(flat(root.at(T)), fmt::format("{}: {}", path, T));
    is_known = true;
  }
  return is_known;
}

/// Reads `rotation` and `translation` of DAIR-V2X. The name of the file, or of its folder, says between what they lead:
/// lidar_to_camera. Others of the same form lead to the vehicle or to the world.
bool read_rotation_translation(const std::string& path, const PlainJson& root, ShotCalibration& out) {
  const PlainJson& pose = root.contains("transform") ? root.at("transform") : root;
  if (!pose.is_object() || !pose.contains("rotation") || !pose.contains("translation")) return false;
  const auto found = pose_of(flat(pose.at("rotation")), flat(pose.at("translation")), path, "rotation", "translation");
  const std::filesystem::path file(path);
  const std::string file_name = lower_case(file.stem().string()),
                    folder = lower_case(file.parent_path().filename().string()),
                    name = file_name.find("_to_") == std::string::npos ? folder : file_name;
  const auto to = std::min(name.find("_to_"), name.size());
  const auto of_camera = [](const std::string& frame) { return frame.find("cam") != std::string::npos; };
  const auto of_laser = [](const std::string& frame) {
    return frame.find("lidar") != std::string::npos || frame.find("velo") != std::string::npos;
  };
  const std::string before = name.substr(0, to), behind = name.substr(to);
  const bool leads_to_camera = of_laser(before) && of_camera(behind),
             comes_from_camera = of_camera(before) && of_laser(behind);
  if (leads_to_camera == comes_from_camera)
    throw config::ConfigError(path +
                              ": holds a rotation and a translation, and neither its name nor that of its folder says "
                              "that they lead from the laser to the camera (lidar_to_camera) or back "
                              "(camera_to_lidar): give the file such a name if they do");
  out.T_lens_scanner = leads_to_camera ? found : turned_round(found);
  if (comes_from_camera) out.pose_note = turned_by_name(path);
  return true;
}

}  // namespace

void read_published_json(const std::string& path, CalibrationParts& out) {
  constexpr const char* kForms =
      ": holds neither K and T, nor a member with param.cam_K or param.sensor_calib (SensorsCalibration), nor "
      "camera.intrinsics (direct_visual_lidar_calibration), nor intrinsic and extrinsic (SUSTechPOINTS), nor cam_K, or "
      "rotation and translation (DAIR-V2X)";
  try {
    const PlainJson root = PlainJson::parse(config::read_configuration(path));
    if (!root.is_object()) throw config::ConfigError(path + kForms);
    bool is_known = read_k_d_t(path, root, out.shot);
    is_known |= read_bare_matrices(path, root, out.shot);
    is_known = is_known || read_rotation_translation(path, root, out.shot);
    for (const auto& [name, member] : root.items()) {
      if (!member.is_object()) continue;
      if (member.contains("param")) {
        const std::string from = member.value("sensor_name", ""), to = member.value("target_sensor_name", "");
        if (member.at("param").contains("sensor_calib") && !to.empty() &&
            lower_case(to).find("cam") == std::string::npos)
          throw config::ConfigError(fmt::format(
              "{}: holds the pose of {} in the frame of {}, and that of a laser in a camera's frame is wanted", path,
              from, to));
        read_sensors_calibration(path, member.at("param"), out.shot);
        is_known = true;
      } else if (name == "camera" && member.contains("intrinsics")) {
        read_direct_visual(path, root, out.shot);
        is_known = true;
      } else if (name == "camera" || name == "cam") {
        is_known |= read_k_d_t(path, member, out.shot);
      }
    }
    if (!is_known) throw config::ConfigError(path + kForms);
  } catch (const PlainJson::exception& e) {
    throw config::ConfigError(fmt::format("{}: {}", path, e.what()));
  }
}

}  // namespace hueline::apps
