#pragma once

#include <GeographicLib/LocalCartesian.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "core/stamped.hpp"
#include "fusion/rig_geometry.hpp"

/// A simulated drive with known truth. Motion, laser returns and images are made with separate mathematics
/// (GeographicLib, and the papers' matrices written out), so that a sign error in fusion/ cannot be hidden by the same
/// error here.
namespace hueline::test {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

/// R_enu_body from the row form of papers/sphere-fusion step 2 (roll, pitch, heading = phi, omega, kappa).
Matrix3 paper_enu_from_imu(double roll, double pitch, double heading);

/// A curved path with pitching, rolling and bumps, against a fixed local level at kBase.
struct Motion {
  double speed = 12.0;      ///< m/s
  double turn_rate = 0.15;  ///< rad/s
  double shake = 1.0;       ///< scale of the vehicle's dynamics
  Vector3 position(double t) const;
  Vector3 velocity(double t) const;
  Matrix3 R_base_body(double t) const;
};

constexpr std::int64_t kStart = 1'400'000'000LL * 1'000'000'000LL;  // GPS ns of t = 0
inline GpsTime at(double t) { return gps_time_ns(kStart) + from_seconds(t); }

class Drive {
 public:
  explicit Drive(const Motion& motion);
  /// Returns what a POS reports at t: geodetic position, velocity, and attitude in the level at that position.
  InsSolution solution(double t) const;
  /// Calculates the exact body pose in the local level at `origin` (any geodetic place).
  void pose_in(const Geodetic& origin, double t, Matrix3& R, Vector3& p) const;
  /// Converts a point from the base level to the level at `origin`.
  Vector3 point_in(const Geodetic& origin, const Vector3& p_base) const;
  /// Returns the laser return that hits p_base at the firing time.
  LaserReturn hit(const Vector3& p_base, double t, double batch_t, const fusion::LaserMount& mount) const;
  const Motion& motion() const { return motion_; }

 private:
  Motion motion_;
  GeographicLib::LocalCartesian base_;
};

/// Six lenses (five around, one up) like a Ladybug, small images, stacked in one image of camera 10; laser 20.
fusion::RigGeometry ladybug_rig(fusion::LensModel model);
constexpr SensorId kCamera = 10, kLaser = 20;

/// Makes an RGB image of the whole stack, with each pixel from colour(x, y, channel).
Image make_image(std::uint32_t width, std::uint32_t height, PixelFormat format,
                 const std::function<double(std::uint32_t, std::uint32_t, int)>& colour);
Exposure make_exposure(std::uint32_t index, double t, const Image& image);

/// Makes packets of `per_batch` returns over [from, to). The points are scattered deterministically on the road and on
/// two facades.
std::vector<StampedLaserBatch> scan(const Drive& drive, const fusion::LaserMount& mount, double from, double to,
                                    double packet_rate, int per_batch, std::vector<Vector3>* truth_base = nullptr);

/// Calculates the pixel of a point of the head's frame in a lens, with formulas written out separately.
bool project_truth(const fusion::LensMount& lens, const Vector3& p_head, Eigen::Vector2d& pixel);

}  // namespace hueline::test
