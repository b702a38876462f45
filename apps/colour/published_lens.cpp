#include "apps/colour/published_lens.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>

#include "config/section.hpp"

namespace hueline::apps {
namespace {

using Pose = Transform<Lens, Scanner>;

bool is_fisheye_model(const std::string& model) {
  return model == "equidistant" || model == "equi" || model == "fisheye";
}

}  // namespace

Pose pose_of(const Matrix34& T, const std::string& where) {
  const Eigen::Matrix3d R = T.leftCols<3>();
  if (!T.allFinite() || !(R * R.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-3) || R.determinant() < 0)
    throw config::ConfigError(where + " is no rotation: its rows are not orthonormal within 0.001, or mirror");
  // A rotation that is written with few digits is made one. The lens keeps its place: with a cloud in coordinates of a
  // map the last digit of the rotation would move it by metres.
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(R).normalized();
  return {rotation, rotation * (R.inverse() * T.col(3))};
}

Pose pose_of(const Numbers& T, const std::string& where) {
  if (T.size() != 12 && T.size() != 16)
    throw config::ConfigError(fmt::format("{} has {} numbers; allowed: 12 or 16, rows of 4", where, T.size()));
  if (T.size() == 16 && (T[12] != 0 || T[13] != 0 || T[14] != 0 || T[15] != 1))
    throw config::ConfigError(where +
                              " is no pose: its last row is not 0 0 0 1, as if its columns stood one after another");
  return pose_of(Matrix34(Eigen::Map<const Matrix34>(T.data())), where);
}

Pose turned_round(const Pose& T_scanner_lens) {
  const Eigen::Quaterniond R = T_scanner_lens.rotation.conjugate();
  return {R, -(R * T_scanner_lens.translation)};
}

std::string lower_case(std::string word) {
  std::ranges::transform(word, word.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word;
}

void check_model(const std::string& file, const std::string& model) {
  const auto known = {"", "plumb_bob", "radtan", "rational_polynomial", "none"};
  if (is_fisheye_model(model) || std::ranges::find(known, model) != known.end()) return;
  throw config::ConfigError(
      fmt::format("{}: the lens model {} is not read; allowed: plumb_bob, radtan, "
                  "rational_polynomial with k4 to k6 of 0, equidistant, fisheye, none",
                  file, model));
}

void take_lens(const PublishedLens& lens, const std::string& file, const std::string& key, ShotCalibration& out) {
  const std::string where = file + ": " + key;
  if (lens.K.size() != 9)
    throw config::ConfigError(fmt::format("{} has {} numbers; allowed: 9, rows of 3", where, lens.K.size()));
  const Eigen::Map<const Matrix3> K(lens.K.data());
  if (K(1, 0) != 0 || K(2, 0) != 0 || K(2, 1) != 0 || K(2, 2) != 1)
    throw config::ConfigError(where + " is no camera matrix: its rows are fx 0 cx, 0 fy cy, 0 0 1");
  if (std::abs(K(0, 1)) > 1e-6 * K(0, 0))
    throw config::ConfigError(fmt::format("{} has a skew of {} px, which the lens model has not", where, K(0, 1)));
  check_model(file, lens.model);
  const bool is_fisheye = is_fisheye_model(lens.model);
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

Numbers camera_matrix(const Numbers& v) { return {v[0], 0, v[2], 0, v[1], v[3], 0, 0, 1}; }

std::string loose_model(const std::string& word) {
  const std::string lower = lower_case(word);
  for (const char* fisheye : {"fisheye", "equidistant", "kannala"})
    if (lower.find(fisheye) != std::string::npos) return "equidistant";
  for (const char* other :
       {"omni", "mei", "double_sphere", "eucm", "fov", "atan", "ocam", "scaramuzza", "equirect", "spherical"})
    if (lower.find(other) != std::string::npos) return word;
  return {};
}

void check_distortion(const std::string& file, const std::string& key, const Numbers& numbers, bool is_empty) {
  if (numbers.empty() && !is_empty)
    throw config::ConfigError(
        fmt::format("{}: {} is no list of numbers: the lens would be taken for one without a distortion", file, key));
}

}  // namespace hueline::apps
