#include "apps/colour/published_calibration.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <vector>

#include "config/section.hpp"

namespace hueline::apps {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Pose = Transform<Lens, Scanner>;
using PlainJson = nlohmann::json;

/// The rows of a matrix, one after another.
using Numbers = std::vector<double>;

Pose pose_of(const Matrix34& T, const std::string& where) {
  const Eigen::Matrix3d R = T.leftCols<3>();
  if (!T.allFinite() || !(R * R.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-3) || R.determinant() < 0)
    throw config::ConfigError(where + " is no rotation: its rows are not orthonormal within 0.001, or mirror");
  return {Eigen::Quaterniond(R).normalized(), T.col(3)};
}

/// Reads 3 or 4 rows of 4 numbers.
Pose pose_of(const Numbers& T, const std::string& where) {
  if (T.size() != 12 && T.size() != 16)
    throw config::ConfigError(fmt::format("{} has {} numbers; allowed: 12 or 16, rows of 4", where, T.size()));
  return pose_of(Matrix34(Eigen::Map<const Matrix34>(T.data())), where);
}

/// Returns the pose of the laser in the lens's frame from that of the lens in the laser's frame.
Pose turned_round(const Pose& T_scanner_lens) {
  const Eigen::Quaterniond R = T_scanner_lens.rotation.conjugate();
  return {R, -(R * T_scanner_lens.translation)};
}

/// What the files say of a lens.
struct PublishedLens {
  Numbers K, distortion;
  std::string model;  ///< in the words of ROS or Kalibr; empty: k1 k2 p1 p2 [k3]
  std::uint32_t width = 0, height = 0;
};

void take_lens(const PublishedLens& lens, const std::string& file, const std::string& key, ShotCalibration& out) {
  const std::string where = file + ": " + key;
  if (lens.K.size() != 9)
    throw config::ConfigError(fmt::format("{} has {} numbers; allowed: 9, rows of 3", where, lens.K.size()));
  const Eigen::Map<const Matrix3> K(lens.K.data());
  if (K(1, 0) != 0 || K(2, 0) != 0 || K(2, 1) != 0 || K(2, 2) != 1)
    throw config::ConfigError(where + " is no camera matrix: its rows are fx 0 cx, 0 fy cy, 0 0 1");
  if (std::abs(K(0, 1)) > 1e-6 * K(0, 0))
    throw config::ConfigError(fmt::format("{} has a skew of {} px, which the lens model has not", where, K(0, 1)));
  const bool is_fisheye = lens.model == "equidistant" || lens.model == "equi" || lens.model == "fisheye";
  const auto known = {"", "plumb_bob", "radtan", "rational_polynomial", "none"};
  if (!is_fisheye && std::ranges::find(known, lens.model) == known.end())
    throw config::ConfigError(
        fmt::format("{}: the lens model {} is not read; allowed: plumb_bob, radtan, "
                    "rational_polynomial with k4 to k6 of 0, equidistant, fisheye, none",
                    file, lens.model));
  const std::size_t most = is_fisheye ? 4 : 5;
  if (std::ranges::any_of(lens.distortion.begin() + static_cast<std::ptrdiff_t>(std::min(most, lens.distortion.size())),
                          lens.distortion.end(), [](double v) { return v != 0; }))
    throw config::ConfigError(fmt::format("{}: the lens has {} numbers of distortion; its model has {}{}", file,
                                          lens.distortion.size(), most, is_fisheye ? "" : ": k1 k2 p1 p2 k3"));
  fusion::CameraIntrinsics found;
  found.model = is_fisheye ? fusion::LensModel::KannalaBrandt : fusion::LensModel::Brown;
  found.focal_px = {K(0, 0), K(1, 1)};
  found.principal_point_px = {K(0, 2), K(1, 2)};
  std::copy_n(lens.distortion.begin(), std::min(most, lens.distortion.size()), found.distortion.begin());
  found.width = lens.width;
  found.height = lens.height;
  out.intrinsics = found;
  out.lens_file = file;
}

/// Makes rows of a camera matrix from fx fy cx cy.
Numbers camera_matrix(const Numbers& v) { return {v[0], 0, v[2], 0, v[1], v[3], 0, 0, 1}; }

constexpr int kDeepest = 3;  // lists in lists, of a matrix

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
  if (focal.size() != 4) throw config::ConfigError(path + ": camera.intrinsics needs fx, fy, cx and cy");
  take_lens({.K = camera_matrix(focal),
             .distortion = flat(camera.at("distortion_coeffs")),
             .model = camera.value("camera_model", "")},
            path, "camera.intrinsics", out);
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
  if (has_lens)
    take_lens({.K = flat(root.at("K")), .distortion = root.contains("D") ? flat(root.at("D")) : Numbers(), .model = {}},
              path, "K", out);
  if (has_pose) out.T_lens_scanner = pose_of(flat(root.at("T")), path + ": T");
  return has_lens || has_pose;
}

/// Lines of the form "NAME: number number ...", and numbers on lines without a name, by the latest word alone on a
/// line.
struct NamedNumbers {
  std::map<std::string, Numbers> by_name;
  std::map<std::string, Numbers> unnamed;
};

NamedNumbers named_numbers(const std::string& path) {
  NamedNumbers out;
  std::istringstream in(config::read_configuration(path));
  std::string title;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const auto colon = line.find(':');
    std::string text = colon == std::string::npos ? line : line.substr(colon + 1);
    std::ranges::replace(text, ',', ' ');
    std::istringstream values(text);
    Numbers list;
    for (double value; values >> value;) list.push_back(value);
    if (colon != std::string::npos) {
      out.by_name[line.substr(0, colon)] = std::move(list);
      continue;
    }
    std::string word;
    values.clear();
    if (!list.empty()) {
      if (values >> word) throw config::ConfigError(fmt::format("{}:{}: '{}' is no number", path, number, word));
      Numbers& all = out.unnamed[title];
      all.insert(all.end(), list.begin(), list.end());
    } else if (std::istringstream words(text); words >> title && !(words >> word)) {
      continue;
    } else {
      throw config::ConfigError(fmt::format("{}:{}: is neither 'NAME: numbers' nor a row of numbers", path, number));
    }
  }
  return out;
}

/// Matrices without names tell what they are by their size: 9 numbers are K, 12 or 16 T, and 4 or 5 under a title that
/// begins with "dist" the distortion.
void read_unnamed(const std::string& path, const std::map<std::string, Numbers>& matrices, ShotCalibration& out) {
  PublishedLens lens;
  for (const auto& [title, values] : matrices) {
    if (values.size() == 9) {
      lens.K = values;
    } else if (title.starts_with("dist") && (values.size() == 4 || values.size() == 5)) {
      lens.distortion = values;
    } else {
      out.T_lens_scanner = pose_of(values, path + ": the matrix" + (title.empty() ? "" : " " + title));
    }
  }
  if (!lens.K.empty()) take_lens(lens, path, "the camera matrix", out);
}

/// One text of KITTI, whose left colour camera has the number 2.
class KittiText {
 public:
  KittiText(const std::string& path, const std::map<std::string, Numbers>& lines) : path_(path), lines_(lines) {}

  bool read(CalibrationParts& out) const {
    if (has("P2") && (has("Tr_velo_to_cam") || has("Tr"))) {
      const char* name = has("Tr_velo_to_cam") ? "Tr_velo_to_cam" : "Tr";
      out.T_first_scanner = pose_of(numbers(name, 12), path_ + ": " + name);
      read_projection("P2", "R0_rect", out);
      return true;
    }
    if (has("P_rect_02")) {
      read_projection("P_rect_02", "R_rect_00", out);
      if (has("S_rect_02")) {
        const Numbers size = numbers("S_rect_02", 2);
        out.shot.intrinsics->width = static_cast<std::uint32_t>(std::clamp(size[0], 0.0, 1e6));
        out.shot.intrinsics->height = static_cast<std::uint32_t>(std::clamp(size[1], 0.0, 1e6));
      }
      return true;
    }
    if (!has("R") || !has("T") || has("K")) return false;
    const Numbers R = numbers("R", 9), t = numbers("T", 3);
    Matrix34 T;
    T.leftCols<3>() = Eigen::Map<const Matrix3>(R.data());
    T.col(3) = Eigen::Map<const Eigen::Vector3d>(t.data());
    out.T_first_scanner = pose_of(T, path_ + ": R");
    return true;
  }

 private:
  bool has(const char* name) const { return lines_.contains(name); }
  const Numbers& numbers(const char* name, std::size_t count) const {
    const Numbers& found = lines_.at(name);
    if (found.size() != count)
      throw config::ConfigError(fmt::format("{}: {} has {} numbers; allowed: {}", path_, name, found.size(), count));
    return found;
  }
  /// P = K [I | t] leads from the rectified first camera, in whose frame the rectified colour camera stands at -t.
  void read_projection(const char* projection, const char* rectification, CalibrationParts& out) const {
    const Numbers values = numbers(projection, 12);
    const Eigen::Map<const Matrix34> P(values.data());
    const Matrix3 K = P.leftCols<3>();
    take_lens({.K = {K.data(), K.data() + 9}, .distortion = {}, .model = {}}, path_, projection, out.shot);
    Matrix34 T = Matrix34::Identity();
    if (has(rectification)) T.leftCols<3>() = Eigen::Map<const Matrix3>(numbers(rectification, 9).data());
    T.col(3) = K.inverse() * P.col(3);
    const Pose pose = pose_of(T, path_ + ": " + rectification);
    out.T_lens_first = Transform<Lens, Lens>{pose.rotation, pose.translation};
  }

  const std::string& path_;
  const std::map<std::string, Numbers>& lines_;
};

/// Reads the numbers of a node: a list, or a matrix with rows, cols and data.
Numbers numbers_of(const YAML::Node& node, int depth = kDeepest) {
  Numbers out;
  if (depth == 0) return out;
  if (node.IsMap()) return node["data"] ? numbers_of(node["data"], depth - 1) : out;
  for (const auto& one : node) {
    if (one.IsSequence()) {
      const Numbers inner = numbers_of(one, depth - 1);
      out.insert(out.end(), inner.begin(), inner.end());
    } else {
      out.push_back(one.as<double>());
    }
  }
  return out;
}

/// Returns the first of these keys that the mapping has; empty if it has none.
std::string first_key(const YAML::Node& root, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (root[key]) return key;
  return {};
}

std::uint32_t pixels(const YAML::Node& node) {
  return node && node.IsScalar() ? node.as<std::uint32_t>() : std::uint32_t{0};
}

/// Reads what ROS's camera_calibration and OpenCV's FileStorage write.
bool read_matrices(const std::string& path, const YAML::Node& root, ShotCalibration& out) {
  const std::string K = first_key(root, {"camera_matrix", "CameraMat"});
  if (!K.empty()) {
    PublishedLens lens;
    lens.K = numbers_of(root[K]);
    const std::string D = first_key(root, {"distortion_coefficients", "DistCoeff", "dist_coeffs"});
    if (!D.empty()) lens.distortion = numbers_of(root[D]);
    if (root["distortion_model"]) lens.model = root["distortion_model"].as<std::string>();
    lens.width = pixels(root["image_width"]);
    lens.height = pixels(root["image_height"]);
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
  if (focal.size() != 4 || model != "pinhole")
    throw config::ConfigError(path +
                              ": cam0 is read if its camera_model is pinhole and its intrinsics are fu, fv, pu, pv");
  PublishedLens lens{.K = camera_matrix(focal), .distortion = {}, .model = {}};
  if (camera["distortion_coeffs"]) lens.distortion = numbers_of(camera["distortion_coeffs"]);
  if (camera["distortion_model"]) lens.model = camera["distortion_model"].as<std::string>();
  if (const YAML::Node size = camera["resolution"]; size && size.IsSequence() && size.size() == 2) {
    lens.width = pixels(size[0]);
    lens.height = pixels(size[1]);
  }
  take_lens(lens, path, "cam0", out);
  return true;
}

}  // namespace

void read_published_json(const std::string& path, CalibrationParts& out) {
  constexpr const char* kForms =
      ": holds neither K and T, nor a member with param.cam_K or param.sensor_calib (SensorsCalibration), nor "
      "camera.intrinsics (direct_visual_lidar_calibration)";
  try {
    const PlainJson root = PlainJson::parse(config::read_configuration(path));
    if (!root.is_object()) throw config::ConfigError(path + kForms);
    bool is_known = read_k_d_t(path, root, out.shot);
    for (const auto& [name, member] : root.items()) {
      if (!member.is_object()) continue;
      if (member.contains("param")) {
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

void read_published_text(const std::string& path, CalibrationParts& out) {
  const NamedNumbers found = named_numbers(path);
  const auto& lines = found.by_name;
  if (const auto K = lines.find("K"); K != lines.end()) {
    const auto D = lines.find("D");
    take_lens({.K = K->second, .distortion = D == lines.end() ? Numbers() : D->second, .model = {}}, path, "K",
              out.shot);
    if (const auto T = lines.find("T"); T != lines.end()) out.shot.T_lens_scanner = pose_of(T->second, path + ": T");
    return;
  }
  if (KittiText(path, lines).read(out)) return;
  if (lines.empty() && !found.unnamed.empty()) return read_unnamed(path, found.unnamed, out.shot);
  throw config::ConfigError(path +
                            ": holds neither K, D and T, nor P2 with Tr_velo_to_cam or Tr, P_rect_02, or R and T of "
                            "KITTI, nor rows of numbers alone");
}

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
    const bool has_matrices = read_matrices(path, root, out.shot);
    // A program that keeps its settings in the same file has the lens in a part of its own.
    const YAML::Node camera = root["camera"];
    const bool has_part = camera && camera.IsMap() && read_matrices(path, camera, out.shot);
    return has_matrices || has_part || read_kalibr(path, root, out.shot);
  } catch (const YAML::Exception& e) {
    throw config::ConfigError(fmt::format("{}:{}: {}", path, e.mark.line + 1, e.msg));
  }
}

}  // namespace hueline::apps
