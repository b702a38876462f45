#include "apps/colour/published_lens.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <string_view>

#include "apps/colour/other_lens.hpp"
#include "config/section.hpp"

namespace hueline::apps {
namespace {

using Pose = Transform<Lens, Scanner>;

bool is_fisheye_model(const std::string& model) {
  return model == "equidistant" || model == "equi" || model == "fisheye";
}

constexpr double kMostOff_px = 1;  // of the nearest lens from a published one

/// The lens models that hueline does not compute with, by their names in the files, and how many numbers of shape and
/// of distortion they have.
struct OtherModel {
  const char* name;
  std::size_t shape, distortion;
  LensRadius (*radius)(double angle, const Numbers& shape, const Numbers& distortion);
};

constexpr double kUnseen = std::numeric_limits<double>::quiet_NaN();

/// Mei's model (ICRA 2007): omni of Kalibr, MEI of camodocal, omnidir of OpenCV.
LensRadius omni_radius(double angle, const Numbers& shape, const Numbers& distortion) {
  const double z = std::cos(angle) + shape[0], m = std::sin(angle) / z, q = m * m;
  const auto k = [&](std::size_t i) { return i < distortion.size() ? distortion[i] : 0.0; };
  return z > 0 ? LensRadius{m, m * (1 + q * (k(0) + q * k(1)))} : LensRadius{kUnseen, kUnseen};
}

/// The double sphere of Usenko et al. (3DV 2018).
LensRadius double_sphere_radius(double angle, const Numbers& shape, const Numbers& /*distortion*/) {
  const double z = std::cos(angle) + shape[0], d = std::hypot(std::sin(angle), z),
               m = std::sin(angle) / (shape[1] * d + (1 - shape[1]) * z);
  return {m, m};
}

/// The extended unified model of Khomutenko et al. (2016).
LensRadius eucm_radius(double angle, const Numbers& shape, const Numbers& /*distortion*/) {
  const double s = std::sin(angle), c = std::cos(angle), d = std::sqrt(shape[1] * s * s + c * c),
               m = s / (shape[0] * d + (1 - shape[0]) * c);
  return {m, m};
}

/// The field-of-view model of Devernay and Faugeras (2001).
LensRadius fov_radius(double angle, const Numbers& /*shape*/, const Numbers& distortion) {
  const double w = distortion[0], m = std::tan(angle);
  if (!(angle < 1.55)) return {kUnseen, kUnseen};
  return {m, std::atan(2 * m * std::tan(w / 2)) / w};
}

/// k1 k2 p1 p2 k3 k4 k5 k6 of OpenCV.
LensRadius rational_radius(double angle, const Numbers& /*shape*/, const Numbers& k) {
  if (!(angle < 1.55)) return {kUnseen, kUnseen};
  const double m = std::tan(angle), q = m * m, below = 1 + q * (k[5] + q * (k[6] + q * k[7]));
  return {m, below > 0 ? m * (1 + q * (k[0] + q * (k[1] + q * k[4]))) / below : kUnseen};
}

constexpr std::array<OtherModel, 5> kOtherModels{{{"omni", 1, 4, omni_radius},
                                                  {"ds", 2, 0, double_sphere_radius},
                                                  {"eucm", 2, 0, eucm_radius},
                                                  {"fov", 0, 1, fov_radius},
                                                  {"rational", 0, 8, rational_radius}}};

/// Returns the model of a lens that is none of hueline's, with all its numbers; null if it is one, or not read.
const OtherModel* other_model(const PublishedLens& lens) {
  const Numbers& k = lens.distortion;
  const bool is_rational = lens.shape.empty() && !is_fisheye_model(lens.model) && k.size() >= 8 &&
                           std::any_of(k.begin() + 5, k.begin() + 8, [](double v) { return v != 0; });
  for (const OtherModel& one : kOtherModels) {
    const std::string_view name = one.name;
    if (name == "rational" ? !is_rational : lens.model != name || lens.shape.size() != one.shape) continue;
    if (name == "fov" && (k.empty() || !(k[0] > 0.01 && k[0] < 3))) continue;
    if (std::any_of(k.begin() + static_cast<std::ptrdiff_t>(std::min(one.distortion, k.size())), k.end(),
                    [](double v) { return v != 0; }))
      continue;
    return &one;
  }
  return nullptr;
}

/// Takes the lens of hueline's that is nearest to a lens of another model.
void take_other_lens(const PublishedLens& lens, const OtherModel& model, const Matrix3& K, const std::string& file,
                     ShotCalibration& out) {
  OtherLens other{lens.width, lens.height, {K(0, 0), K(1, 1)}, {K(0, 2), K(1, 2)}, {}};
  other.radius = [&](double angle) { return model.radius(angle, lens.shape, lens.distortion); };
  if (model.distortion >= 4 && lens.distortion.size() >= 4)
    other.p1 = lens.distortion[2], other.p2 = lens.distortion[3];
  if (lens.width == 0 || lens.height == 0)
    throw config::ConfigError(fmt::format(
        "{}: the size of the image is missing, and a lens of the model {} is not read without", file, model.name));
  const auto found = nearest_lens(other);
  if (!found || !(found->worst_px <= kMostOff_px))
    throw config::ConfigError(fmt::format(
        "{}: the lens of the model {} is read as the nearest one of brown or kannala_brandt, but that is {} from it",
        file, model.name, found ? fmt::format("{:.1f} px", found->worst_px) : std::string("too far")));
  out.intrinsics = found->intrinsics;
  out.lens_file = file;
  out.lens_note = fmt::format(
      "the lens of {} has the model {}; the {} nearest to it is used, which is at most {:.2f} px from it\n", file,
      model.name, found->intrinsics.model == fusion::LensModel::Brown ? "brown lens" : "kannala_brandt lens",
      found->worst_px);
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

Pose pose_of(const Numbers& R, const Numbers& t, const std::string& file, const char* R_key, const char* t_key) {
  if (R.size() != 9 || t.size() != 3)
    throw config::ConfigError(
        fmt::format("{}: {} has {} numbers and {} {}; allowed: 9 and 3", file, R_key, R.size(), t_key, t.size()));
  Matrix34 T;
  T.leftCols<3>() = Eigen::Map<const Matrix3>(R.data());
  T.col(3) = Eigen::Map<const Eigen::Vector3d>(t.data());
  return pose_of(T, file + ": " + R_key);
}

std::string turned_by_name(const std::string& file) {
  return file + ": is the pose of the camera in the laser's frame, by its name, and was turned round\n";
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
                  "rational_polynomial, equidistant, fisheye, none, and of Kalibr omni, ds, eucm and fov",
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
  if (const OtherModel* other = other_model(lens)) return take_other_lens(lens, *other, K, file, out);
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
