#include "core/mounting.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/angle.hpp"
#include "core/portable_math.hpp"

namespace hueline {
namespace {

Eigen::Matrix3d matrix_of(const std::vector<double>& rows) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
}
Eigen::Quaterniond quaternion_of(const std::vector<double>& wxyz) { return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]}; }

}  // namespace

void Mounting::visit(Keys& keys) {
  keys.numbers(required("position_m", "m", "The place of the sensor's origin: x, y, z."), position_m, {-100, 100});
  keys.one_of({"rotation_deg", "rotation_matrix", "quaternion_wxyz"});
  keys.numbers({"rotation_deg", "deg", "`[a, b, c]`: R = Rz(c) Ry(b) Rx(a)."}, rotation_deg, {-360, 360}, {3, 3});
  keys.numbers({"rotation_matrix", "", "The matrix by rows, orthonormal within 1e-6."}, rotation_matrix,
               {-1.000001, 1.000001}, {9, 9});
  keys.numbers({"quaternion_wxyz", "", "A quaternion of length 1 within 0.001."}, quaternion_wxyz, {-1.0001, 1.0001},
               {4, 4});
  keys.section({"calibration", "", "How the mounting was calibrated: a [record](#calibration-records).", "none"},
               calibration);
}

KeyError Mounting::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (!rotation_matrix.empty()) {
    const Eigen::Matrix3d R = matrix_of(rotation_matrix);
    if (!(R * R.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-6) || R.determinant() < 0)
      return {"rotation_matrix", "is no rotation: its rows are not orthonormal within 1e-6, or it mirrors"};
  }
  if (!quaternion_wxyz.empty() && std::abs(quaternion_of(quaternion_wxyz).norm() - 1) > 1e-3)
    return not_allowed("quaternion_wxyz", "of length " + number_text(quaternion_of(quaternion_wxyz).norm()),
                       "1 within 0.001");
  return {};
}

Eigen::Quaterniond Mounting::rotation() const {
  if (!rotation_deg.empty()) {
    const Eigen::Vector3d a = Eigen::Vector3d(rotation_deg[0], rotation_deg[1], rotation_deg[2]) * kRadPerDeg;
    using portable::rotation_about, Eigen::Vector3d;
    return rotation_about(Vector3d::UnitZ(), a.z()) * rotation_about(Vector3d::UnitY(), a.y()) *
           rotation_about(Vector3d::UnitX(), a.x());
  }
  if (!rotation_matrix.empty()) return Eigen::Quaterniond(matrix_of(rotation_matrix)).normalized();
  if (!quaternion_wxyz.empty()) return quaternion_of(quaternion_wxyz).normalized();
  return Eigen::Quaterniond::Identity();
}

}  // namespace hueline
