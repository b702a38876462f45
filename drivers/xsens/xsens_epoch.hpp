#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "core/measurements.hpp"

namespace hueline::drivers {

/// What an MTi says of one moment, by whichever messages. The sensor's axes are forward, left, up.
struct XsensEpoch {
  /// The bits of the device's status word that are used.
  static constexpr std::uint32_t kFilterValid = 2, kGnssFix = 4;

  std::optional<GpsTime> time;
  std::optional<Eigen::Vector3d> acceleration;        ///< m/s^2, in the sensor's axes
  std::optional<Eigen::Vector3d> rate;                ///< rad/s, in the sensor's axes
  std::optional<Eigen::Quaterniond> R_enu_sensor;     ///< orientation of the sensor
  std::optional<Eigen::Vector3d> velocity_enu;        ///< m/s
  std::optional<double> latitude_deg, longitude_deg;  ///< degrees
  std::optional<double> height_m;                     ///< above the ellipsoid
  std::optional<std::uint32_t> status;                ///< the device's status word

  /// Returns whether it holds something that is worth a time.
  bool needs_time() const { return acceleration || R_enu_sensor || latitude_deg; }
  /// Returns the inertial sample, if it has one and its time.
  std::optional<ImuSample> sample() const;
  /// Returns the solution, if it is whole, has its time and can be true.
  std::optional<InsSolution> solution() const;
};

/// Follows the counter of 16 bits that the device sends with its samples. Thread safety: none.
class XsensCounter {
 public:
  /// Returns how many samples are missing before the one with this count. More than half the range ahead is a restart.
  std::uint64_t take(std::uint16_t count);
  void forget() { last_.reset(); }

 private:
  std::optional<std::uint16_t> last_;
};

/// Returns the orientation that a quaternion (w, x, y, z) or Euler angles (roll, pitch, yaw, degrees) state, or nothing
/// if the quaternion is none.
std::optional<Eigen::Quaterniond> xsens_quaternion(double w, double x, double y, double z);
Eigen::Quaterniond xsens_euler(double roll_deg, double pitch_deg, double yaw_deg);

}  // namespace hueline::drivers
