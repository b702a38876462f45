#include "apps/colour/shot_calibration.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "config/key_reader.hpp"
#include "config/section.hpp"
#include "core/mounting.hpp"

namespace hueline::apps {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Transform<Lens, Scanner> transform_of(const Matrix34& T, const std::string& where) {
  const Eigen::Matrix3d R = T.leftCols<3>();
  if (!T.allFinite() || !(R * R.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-3) || R.determinant() < 0)
    throw config::ConfigError(where + " is no rotation: its rows are not orthonormal within 0.001, or mirror");
  return {Eigen::Quaterniond(R).normalized(), T.col(3)};
}

fusion::CameraIntrinsics brown(const Matrix3& K, const std::vector<double>& distortion, const std::string& where) {
  if (K(1, 0) != 0 || K(2, 0) != 0 || K(2, 1) != 0 || K(2, 2) != 1)
    throw config::ConfigError(where + " is no camera matrix: its rows are fx 0 cx, 0 fy cy, 0 0 1");
  if (std::abs(K(0, 1)) > 1e-6 * K(0, 0))
    throw config::ConfigError(fmt::format("{} has a skew of {} px, which the lens model has not", where, K(0, 1)));
  fusion::CameraIntrinsics lens;
  lens.model = fusion::LensModel::Brown;
  lens.focal_px = {K(0, 0), K(1, 1)};
  lens.principal_point_px = {K(0, 2), K(1, 2)};
  std::copy(distortion.begin(), distortion.end(), lens.distortion.begin());
  return lens;
}

std::vector<double> flat(const nlohmann::json& matrix) {
  std::vector<double> out;
  for (const auto& row : matrix.at("data"))
    for (const auto& value : row) out.push_back(value.get<double>());
  return out;
}

void read_json(const std::string& path, ShotCalibration& out) {
  try {
    const auto root = nlohmann::json::parse(config::read_configuration(path));
    for (const auto& [name, sensor] : root.items()) {
      const auto& param = sensor.at("param");
      if (param.contains("cam_K")) {
        const auto K = flat(param.at("cam_K"));
        const auto k = flat(param.at("cam_dist"));
        if (K.size() != 9 || k.size() < 4 || k.size() > 5)
          throw config::ConfigError(path + ": cam_K needs 9 numbers, cam_dist 4 or 5");
        auto lens = brown(Eigen::Map<const Matrix3>(K.data()), k, path + ": cam_K");
        lens.width = param.value("img_dist_w", 0u);
        lens.height = param.value("img_dist_h", 0u);
        out.intrinsics = lens;
        out.lens_file = path;
      }
      if (param.contains("sensor_calib")) {
        const auto T = flat(param.at("sensor_calib"));
        if (T.size() != 16) throw config::ConfigError(path + ": sensor_calib needs 16 numbers");
        out.T_lens_scanner =
            transform_of(Eigen::Map<const Matrix34>(T.data()), path + ": the rotation of sensor_calib");
      }
    }
  } catch (const nlohmann::json::exception& e) {
    throw config::ConfigError(fmt::format("{}: {}", path, e.what()));
  }
}

/// Reads lines of the form "NAME: number number ...".
std::map<std::string, std::vector<double>> named_numbers(const std::string& path) {
  std::map<std::string, std::vector<double>> out;
  std::istringstream in(config::read_configuration(path));
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const auto colon = line.find(':');
    if (colon == std::string::npos)
      throw config::ConfigError(fmt::format("{}:{}: is not 'NAME: numbers'", path, number));
    std::istringstream values(line.substr(colon + 1));
    std::vector<double>& list = out[line.substr(0, colon)];
    list.clear();
    for (double value; values >> value;) list.push_back(value);
  }
  return out;
}

void read_text(const std::string& path, ShotCalibration& out) {
  const auto lines = named_numbers(path);
  const auto matrix = [&](const std::string& name, std::size_t count) -> const double* {
    const auto found = lines.find(name);
    if (found == lines.end()) return nullptr;
    if (found->second.size() != count)
      throw config::ConfigError(
          fmt::format("{}: {} has {} numbers; allowed: {}", path, name, found->second.size(), count));
    return found->second.data();
  };
  if (const double* K = matrix("K", 9)) {
    const auto D = lines.contains("D") ? lines.at("D") : std::vector<double>{};
    if (D.size() > 5)
      throw config::ConfigError(fmt::format("{}: D has {} numbers; allowed: k1 k2 p1 p2 k3", path, D.size()));
    out.intrinsics = brown(Eigen::Map<const Matrix3>(K), D, path + ": K");
    out.lens_file = path;
    if (const double* T = matrix("T", 12))
      out.T_lens_scanner = transform_of(Eigen::Map<const Matrix34>(T), path + ": T");
    return;
  }
  const double* P = matrix("P2", 12);
  const bool is_object = lines.contains("Tr_velo_to_cam");
  const double* Tr = is_object ? matrix("Tr_velo_to_cam", 12) : matrix("Tr", 12);
  if (!P || !Tr)
    throw config::ConfigError(path + ": holds neither K, D and T nor KITTI's P2 with Tr_velo_to_cam or Tr");
  // P2 = K [I | t]. In the frame of the camera that Tr leads to, the rectified colour camera stands at -t.
  const Eigen::Map<const Matrix34> projection(P);
  const Matrix3 K = projection.leftCols<3>();
  out.intrinsics = brown(K, {}, path + ": P2");
  out.lens_file = path;
  auto T = transform_of(Eigen::Map<const Matrix34>(Tr), path + (is_object ? ": Tr_velo_to_cam" : ": Tr"));
  if (const double* R0 = matrix("R0_rect", 9)) {
    Matrix34 turn = Matrix34::Zero();
    turn.leftCols<3>() = Eigen::Map<const Matrix3>(R0);
    const auto R = transform_of(turn, path + ": R0_rect").rotation;
    T = {R * T.rotation, R * T.translation};
  }
  T.translation += K.inverse() * projection.col(3);
  out.T_lens_scanner = T;
}

/// Reads this project's own form: `lens:` as in a rig, and `T_lens_scanner:` as a mounting; either or both.
void read_yaml(const std::string& path, ShotCalibration& out) {
  config::Section root = config::Section::load_file(path);
  if (root.has("lens")) {
    out.intrinsics = config::read_config<fusion::CameraIntrinsics>(root.section("lens"));
    out.lens_file = path;
  }
  if (root.has("T_lens_scanner"))
    out.T_lens_scanner = config::read_config<Mounting>(root.section("T_lens_scanner")).transform<Lens, Scanner>();
  root.finish();
}

}  // namespace

ShotCalibration read_shot_calibration(const std::vector<std::string>& paths) {
  ShotCalibration out;
  for (const auto& path : paths) {
    if (!std::filesystem::exists(path)) throw config::ConfigError(path + ": is not there");
    path.ends_with(".json")  ? read_json(path, out)
    : path.ends_with(".txt") ? read_text(path, out)
                             : read_yaml(path, out);
  }
  return out;
}

fusion::CameraIntrinsics fit_to_image(const fusion::CameraIntrinsics& lens, const std::string& lens_file, int width,
                                      int height, const std::string& image_file, OtherSize other) {
  fusion::CameraIntrinsics out = lens;
  out.width = static_cast<std::uint32_t>(width);
  out.height = static_cast<std::uint32_t>(height);
  const bool is_other = lens.width != 0 && lens.height != 0 && (lens.width != out.width || lens.height != out.height);
  if (is_other && other == OtherSize::Refuse)
    throw config::ConfigError(
        fmt::format("{} has {} x {} px, the lens of {} has {} x {}: an image of another camera, or another cut or size "
                    "of it. If the image is that of the lens without its right or "
                    "lower border, or the size beside the lens is wrong, give --image-size same-pixels; if it is the "
                    "whole image made smaller or larger, --image-size scaled",
                    image_file, width, height, lens_file, lens.width, lens.height));
  if (is_other && other == OtherSize::Scaled) {
    const Eigen::Array2d scale(double(width) / lens.width, double(height) / lens.height);
    out.focal_px = lens.focal_px.array() * scale;
    out.principal_point_px = (lens.principal_point_px.array() + 0.5) * scale - 0.5;  // pixel centres at whole numbers
  }
  if (const std::string wrong = out.validate(); !wrong.empty()) throw config::ConfigError(lens_file + ": " + wrong);
  return out;
}

const std::vector<std::string> kImageSizeWords = {"refuse", "same-pixels", "scaled"};

OtherSize other_size(const std::string& word) {
  return word == "scaled" ? OtherSize::Scaled : word == "same-pixels" ? OtherSize::SamePixels : OtherSize::Refuse;
}

}  // namespace hueline::apps
