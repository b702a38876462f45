#include "config/mounting.hpp"

#include "config/calibration_record.hpp"

namespace hueline::config {

Mounting read_mounting(Section section) {
  constexpr double kDeg = 3.14159265358979323846 / 180;
  Mounting out;
  out.position_m = section.vector3("position_m", {-100, 100});
  const std::string given = section.one_of({"rotation_deg", "rotation_matrix", "quaternion_wxyz"});
  if (given == "rotation_deg") {
    const Eigen::Vector3d a = section.vector3("rotation_deg", {-360, 360}) * kDeg;
    out.rotation = Eigen::AngleAxisd(a.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(a.y(), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(a.x(), Eigen::Vector3d::UnitX());
  } else if (given == "rotation_matrix") {
    const auto v = section.numbers("rotation_matrix", 9, {-1.000001, 1.000001});
    const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
    if (!(R * R.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-6) || R.determinant() < 0)
      section.refuse("rotation_matrix", "not a rotation: its rows are not orthonormal within 1e-6, or it mirrors");
    out.rotation = Eigen::Quaterniond(R).normalized();
  } else {
    const auto v = section.numbers("quaternion_wxyz", 4, {-1.0001, 1.0001});
    const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
    if (std::abs(q.norm() - 1) > 1e-3) section.refuse("quaternion_wxyz", "its length is not 1 within 0.001");
    out.rotation = q.normalized();
  }
  check_calibration_record(section);
  section.finish();
  return out;
}

}  // namespace hueline::config
