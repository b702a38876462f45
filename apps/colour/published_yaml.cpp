#include "apps/colour/published_calibration.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "apps/colour/published_lens.hpp"
#include "apps/colour/yaml_numbers.hpp"
#include "config/section.hpp"

namespace hueline::apps {
namespace {

/// Reads what ROS's camera_calibration and OpenCV's FileStorage write, and ROS's CameraInfo.
bool read_matrices(const std::string& path, const YAML::Node& root, ShotCalibration& out) {
  const std::string K = first_key(root, {"camera_matrix", "CameraMat", "K", "k"});
  if (!K.empty()) {
    PublishedLens lens;
    lens.K = numbers_of(root[K]);
    const std::string D = first_key(root, kDistortionKeys);
    if (!D.empty()) {
      lens.distortion = numbers_of(root[D]);
      const YAML::Node list = root[D].IsMap() ? root[D]["data"] : root[D];
      check_distortion(path, D, lens.distortion, list && list.IsSequence() && list.size() == 0);
    }
    const std::string model = first_key(root, kModelKeys), loose = first_key(root, kLooseModelKeys),
                      width = first_key(root, kWidthKeys), height = first_key(root, kHeightKeys);
    if (!loose.empty() && root[loose].IsScalar()) lens.model = loose_model(root[loose].Scalar());
    if (!model.empty()) lens.model = lower_case(root[model].as<std::string>());
    // OpenCV's programs of calibration.
    if (root["fisheye_model"] && number_of<int>(root["fisheye_model"]) != 0) lens.model = "fisheye";
    if (root["xi"] && number_of<double>(root["xi"]) != 0) {
      lens.model = "omni";
      lens.shape = {number_of<double>(root["xi"])};
    }
    if (!width.empty()) lens.width = pixels(root[width]);
    if (!height.empty()) lens.height = pixels(root[height]);
    if (const YAML::Node size = root["ImageSize"]; size && size.IsSequence() && size.size() == 2) {
      lens.width = pixels(size[0]);
      lens.height = pixels(size[1]);
    }
    take_lens(lens, path, K, out);
  }
  // Autoware's matrix is the pose of the camera in the laser's frame.
  if (const YAML::Node pose = root["CameraExtrinsicMat"])
    out.T_lens_scanner = turned_round(pose_of(numbers_of(pose), path + ": CameraExtrinsicMat"));
  return !K.empty() || root["CameraExtrinsicMat"];
}

/// Reads the first camera of Kalibr's chain.
bool read_kalibr(const std::string& path, const YAML::Node& root, ShotCalibration& out) {
  const YAML::Node camera = root["cam0"];
  if (!camera || !camera.IsMap() || !camera["intrinsics"]) return false;
  const Numbers focal = numbers_of(camera["intrinsics"]);
  const std::string model = camera["camera_model"] ? camera["camera_model"].as<std::string>() : "";
  const std::string distortion = camera["distortion_model"] ? camera["distortion_model"].as<std::string>() : "";
  const std::size_t shape = model == "omni" ? 1 : model == "ds" || model == "eucm" ? 2 : 0;
  const bool is_none = distortion.empty() || distortion == "none";
  const bool is_read =
      model == "pinhole" || (model == "omni" && (distortion == "radtan" || is_none)) || (shape == 2 && is_none);
  if (!is_read || focal.size() != shape + 4)
    throw config::ConfigError(path +
                              ": cam0 is read if its camera_model is pinhole, omni with radtan, ds or eucm, and its "
                              "intrinsics are those of the model: the last are fu, fv, pu, pv");
  const auto split = focal.begin() + static_cast<std::ptrdiff_t>(shape);
  PublishedLens lens{.K = camera_matrix({split, focal.end()}),
                     .distortion = {},
                     .model = shape == 0 ? distortion : model,
                     .shape = {focal.begin(), split}};
  if (camera["distortion_coeffs"] && distortion != "none") lens.distortion = numbers_of(camera["distortion_coeffs"]);
  if (const YAML::Node size = camera["resolution"]; size && size.IsSequence() && size.size() == 2) {
    lens.width = pixels(size[0]);
    lens.height = pixels(size[1]);
  }
  take_lens(lens, path, "cam0", out);
  if (root["cam1"]) out.lens_note += fmt::format("{} has several cameras; the lens is that of cam0\n", path);
  return true;
}

/// Reads what camodocal writes, and with it KITTI-360 and VINS: the models MEI, PINHOLE and KANNALA_BRANDT.
bool read_camodocal(const std::string& path, const YAML::Node& root, ShotCalibration& out) {
  const YAML::Node projection = root["projection_parameters"], type = root["model_type"];
  if (!projection || !projection.IsMap() || !type || !type.IsScalar()) return false;
  const std::string model = lower_case(type.Scalar());
  const auto numbers = [&](const YAML::Node& node, std::initializer_list<const char*> keys) {
    Numbers found;
    for (const char* key : keys) {
      if (!node || !node.IsMap() || !node[key])
        throw config::ConfigError(fmt::format("{}: {} is missing in the parameters of {}", path, key, type.Scalar()));
      found.push_back(number_of<double>(node[key]));
    }
    return found;
  };
  PublishedLens lens;
  if (model == "mei") {
    lens.model = "omni";
    lens.shape = numbers(root["mirror_parameters"], {"xi"});
    lens.K = camera_matrix(numbers(projection, {"gamma1", "gamma2", "u0", "v0"}));
    lens.distortion = numbers(root["distortion_parameters"], {"k1", "k2", "p1", "p2"});
  } else if (model == "pinhole") {
    lens.K = camera_matrix(numbers(projection, {"fx", "fy", "cx", "cy"}));
    lens.distortion = numbers(root["distortion_parameters"], {"k1", "k2", "p1", "p2"});
  } else if (model == "kannala_brandt") {
    lens.model = "equidistant";
    lens.K = camera_matrix(numbers(projection, {"mu", "mv", "u0", "v0"}));
    lens.distortion = numbers(projection, {"k2", "k3", "k4", "k5"});
  } else {
    throw config::ConfigError(
        fmt::format("{}: model_type {} is not read; allowed: MEI, PINHOLE, KANNALA_BRANDT", path, type.Scalar()));
  }
  if (root["image_width"]) lens.width = pixels(root["image_width"]);
  if (root["image_height"]) lens.height = pixels(root["image_height"]);
  take_lens(lens, path, "projection_parameters", out);
  return true;
}

/// Reads what FAST-LIVO and others that load cameras with vikit have: cam_fx and so on, in the newest without "cam_".
bool read_vikit(const std::string& path, const YAML::Node& root, ShotCalibration& out) {
  const char* const prefix = root["cam_fx"] ? "cam_" : "";
  const auto at = [&](const std::string& name) { return root[prefix + name]; };
  const YAML::Node word = at("model");
  if (!word || !word.IsScalar() || !at("fx") || !at("fy") || !at("cx") || !at("cy")) return false;
  PublishedLens lens;
  const bool is_fisheye = word.Scalar() == "EquidistantCamera";
  if (!is_fisheye && !word.Scalar().starts_with("Pinhole"))
    throw config::ConfigError(
        fmt::format("{}: {}model {} is not read; allowed: Pinhole, EquidistantCamera", path, prefix, word.Scalar()));
  lens.K = camera_matrix({number_of<double>(at("fx")), number_of<double>(at("fy")), number_of<double>(at("cx")),
                          number_of<double>(at("cy"))});
  if (is_fisheye) lens.model = "equidistant";
  for (int i = 0; i < (is_fisheye ? 4 : 5); ++i) {
    const YAML::Node one = is_fisheye ? root[fmt::format("k{}", i + 1)] : at(fmt::format("d{}", i));
    lens.distortion.push_back(one ? number_of<double>(one) : 0);
  }
  lens.width = pixels(at("width"));
  lens.height = pixels(at("height"));
  take_lens(lens, path, prefix + std::string("fx"), out);
  return true;
}

/// Reads FAST-LIVO's pose of the laser in the camera's frame.
bool read_rcl_pcl(const std::string& path, const YAML::Node& root, ShotCalibration& out) {
  if (!root["Rcl"] || !root["Pcl"]) return false;
  out.T_lens_scanner = pose_of(numbers_of(root["Rcl"]), numbers_of(root["Pcl"]), path, "Rcl", "Pcl");
  return true;
}

/// Returns the mappings in which a file of settings may have a calibration: itself, the settings of ROS 2 below the
/// name of a node, and those of a camera and of mountings in them.
std::vector<YAML::Node> parts_of(const YAML::Node& root) {
  std::vector<YAML::Node> out{root};
  for (const auto& member : root)
    if (const YAML::Node node = member.second; node.IsMap())
      if (const YAML::Node settings = node["ros__parameters"]; settings && settings.IsMap()) out.push_back(settings);
  for (std::size_t i = 0, count = out.size(); i < count; ++i)
    for (const char* name : {"camera", "extrin_calib"})
      if (const YAML::Node part = out[i][name]; part && part.IsMap()) out.push_back(part);
  return out;
}

}  // namespace

bool read_published_yaml(const std::string& path, CalibrationParts& out) {
  std::string text = config::read_configuration(path);
  // The first line that OpenCV writes is no YAML.
  if (text.starts_with("%YAML:")) text.erase(0, std::min(text.find('\n'), text.size()));
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception&) {
    return false;
  }
  if (!root.IsMap()) return false;
  try {
    bool is_known = read_framed_pose(path, root, out.shot);
    for (const YAML::Node& part : parts_of(root)) {
      is_known |= read_matrices(path, part, out.shot) || read_vikit(path, part, out.shot);
      is_known |= read_rcl_pcl(path, part, out.shot);
    }
    return is_known || read_kalibr(path, root, out.shot) || read_camodocal(path, root, out.shot);
  } catch (const YAML::Exception& e) {
    throw config::ConfigError(fmt::format("{}:{}: {}", path, e.mark.line + 1, e.msg));
  }
}

}  // namespace hueline::apps
