#include <fmt/format.h>

#include <Eigen/SVD>
#include <cmath>
#include <utility>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "core/utc_text.hpp"
#include "products/image_tables.hpp"
#include "products/text_file.hpp"

namespace hueline::products {
namespace {

constexpr double kStep_m = 5;  // of the places from which the directions of the map's axes follow

/// Writes poses.csv.
class PoseTable : public ImageTable {
 public:
  PoseTable(TextFile file, storage::Projection projection, const PictureSet& set)
      : file_(std::move(file)), projection_(std::move(projection)), set_(set) {}

  void add(const TakenPicture& picture) override {
    const Eigen::Vector3d& p = picture.T_enu_lens.translation;
    const Transform<Ecef, Enu> T_ecef_enu = ecef_from_enu(set_.origin);
    const Geodetic place = to_geodetic(T_ecef_enu * Point<Enu>{p});
    const Eigen::Quaterniond R_level_lens =
        ecef_from_enu(place).rotation.conjugate() * T_ecef_enu.rotation * picture.T_enu_lens.rotation;
    // The camera as a vehicle that drives along its axis: x right, y forward, z up.
    Eigen::Matrix3d R_lens_forward;
    R_lens_forward << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    const Attitude look = attitude_from_enu_body(R_level_lens * Eigen::Quaterniond(R_lens_forward));
    const Eigen::Vector3d map = projection_.project_exactly(p.x(), p.y(), p.z());
    const OmegaPhiKappa angles = omega_phi_kappa(R_map_enu(p) * picture.T_enu_lens.rotation.toRotationMatrix());
    file_.add(fmt::format(
        "{},{},{},{},{:.6f},{:.4f},{:.4f},{:.4f},{:.10f},{:.10f},{:.4f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},"
        "{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.9f},0\n",
        picture.file, set_.lenses[picture.lens].name, picture.exposure, utc_text(picture.time),
        static_cast<double>(count_ns(picture.time) / 1000) * 1e-6, map.x(), map.y(), map.z(),
        place.latitude / kRadPerDeg, place.longitude / kRadPerDeg, place.ellipsoidal_height, angles.omega / kRadPerDeg,
        angles.phi / kRadPerDeg, angles.kappa / kRadPerDeg, look.heading / kRadPerDeg, look.pitch / kRadPerDeg,
        look.roll / kRadPerDeg, picture.sigma_position.x(), picture.sigma_position.y(), picture.sigma_position.z(),
        picture.sigma_attitude.x() / kRadPerDeg, picture.sigma_attitude.y() / kRadPerDeg,
        picture.sigma_attitude.z() / kRadPerDeg, to_seconds(picture.sigma_time)));
  }
  Status close(const ShownPoints&) override { return file_.close(); }

 private:
  /// Returns the rotation that comes nearest to what the map does to directions at a place: convergence of the
  /// meridians, and the tilt against the drive's origin. The map's scale is left out.
  Eigen::Matrix3d R_map_enu(const Eigen::Vector3d& p) const {
    const double plane_m = projection_.operation().unit().metres, up_m = projection_.operation().up_unit().metres;
    Eigen::Matrix3d slopes;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep_m * Eigen::Vector3d::Unit(k), after = p + step, before = p - step;
      slopes.col(k) = (projection_.project_exactly(after.x(), after.y(), after.z()) -
                       projection_.project_exactly(before.x(), before.y(), before.z())) /
                      (2 * kStep_m);
    }
    slopes = Eigen::Vector3d(plane_m, plane_m, up_m).asDiagonal() * slopes;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(slopes, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return svd.matrixU() * svd.matrixV().transpose();
  }

  TextFile file_;
  storage::Projection projection_;
  PictureSet set_;
};

}  // namespace

OmegaPhiKappa omega_phi_kappa(const Eigen::Matrix3d& R_map_lens) {
  Eigen::Matrix3d R = R_map_lens;
  R.col(1) *= -1;
  R.col(2) *= -1;
  OmegaPhiKappa out;
  const double s = std::min(1.0, std::max(-1.0, R(0, 2)));
  out.phi = portable::asin(s);
  if (std::abs(s) < 1 - 1e-12) {
    out.omega = portable::atan2(-R(1, 2), R(2, 2));
    out.kappa = portable::atan2(-R(0, 1), R(0, 0));
  } else {
    out.omega = portable::atan2(R(2, 1), R(1, 1));
  }
  return out;
}

Result<std::unique_ptr<ImageTable>> make_pose_table(const PictureSet& set) {
  auto projection = storage::Projection::create(set.origin, set.map, set.epoch);
  if (!projection) return Error{ErrorCode::Invalid, projection.error().message};
  auto file = TextFile::create(set.folder / "poses.csv");
  if (!file) return file.error();
  const storage::MapOperation& map = projection->operation();
  file->add(fmt::format(
      "file,lens,exposure,utc,gps_s,easting_{0},northing_{0},height_{1},latitude_deg,longitude_deg,"
      "ellipsoidal_height_m,omega_deg,phi_deg,kappa_deg,heading_deg,pitch_deg,roll_deg,sigma_east_m,sigma_north_m,"
      "sigma_up_m,sigma_roll_deg,sigma_pitch_deg,sigma_heading_deg,sigma_time_s,pixels_are_gravity_aligned\n",
      map.unit().name, map.up_unit().name));
  return std::unique_ptr<ImageTable>(std::make_unique<PoseTable>(std::move(*file), std::move(*projection), set));
}

}  // namespace hueline::products
