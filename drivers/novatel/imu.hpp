#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/measurements.hpp"
#include "drivers/novatel/wire.hpp"

/// SPAN's inertial increments -> specific force and angular rate in Body.
namespace hueline::drivers {

/// What one count of RAWIMU means, and how many samples a second. From the tables "Raw IMU Scale Factors" and the rates
/// beside RAWIMUSX in the OEM7 manual.
struct ImuScale {
  double rate_hz = 0;
  double rad_per_count = 0;
  double mps_per_count = 0;  ///< m/s
};
/// By NovAtel's IMU type number (INSCONFIG, RAWIMUX). Empty for a type we have no table entry for.
std::optional<ImuScale> imu_scale(int imu_type);

/// Raw: counts over one sample in the order z, -y, x, in the IMU's own frame. Corrected: radians and m/s in the vehicle
/// frame, from which the receiver has taken gravity and the earth's rotation; both are put back with the latest
/// attitude, so that ImuSample means the same whatever message it came from. Deterministic, thread-bound.
class NovatelImu {
 public:
  struct Config {
    int imu_type = 0;                ///< NovAtel's number; 0: as RAWIMUX or INSCONFIG say
    double rate_hz = 0;              ///< 0: by type
    double rad_per_count = 0;        ///< 0: by type
    double mps_per_count = 0;        ///< m/s; 0: by type
    double corrimudata_rate_hz = 0;  ///< logging rate of CORRIMUDATA(S); 0: those messages are counted and not used
    /// IMU frame to vehicle frame, deg about x, y, z: the numbers of SETINSROTATION RBV. Raw messages only; turned in
    /// the order z, x, y.
    std::array<double, 3> rotation_rbv_deg{0, 0, 0};
    double longest_attitude_age_s = 0.2;  ///< of the solution that puts gravity back
    /// Empty if fine, else which key is outside which range.
    std::string validate() const;
  };

  explicit NovatelImu(const Config& config);

  void learn_type(int imu_type);
  /// Any solution with an attitude; older ones are forgotten.
  void learn_attitude(const InsSolution& solution);
  void forget() { has_attitude_ = false; }

  std::optional<ImuSample> decode_rawimu(std::span<const std::byte> body) const;
  /// Learns the type the message names.
  std::optional<ImuSample> decode_rawimux(std::span<const std::byte> body);
  std::optional<ImuSample> decode_corrimudata(std::span<const std::byte> body) const;
  std::optional<ImuSample> decode_corrimus(const NovatelHeader& header, std::span<const std::byte> body) const;
  std::optional<ImuSample> decode_imuratecorrimus(std::span<const std::byte> body) const;

 private:
  std::optional<ImuSample> from_counts(GpsTime time, std::span<const std::byte> counts) const;
  std::optional<ImuSample> from_corrected(GpsTime time, double per_second, std::span<const std::byte> increments) const;

  Config config_;
  Eigen::Matrix3d R_body_imu_;
  ImuScale scale_;
  bool has_attitude_ = false;
  GpsTime attitude_time_{};
  Eigen::Matrix3d R_body_enu_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d gravity_enu_ = Eigen::Vector3d::Zero(), earth_rate_enu_ = Eigen::Vector3d::Zero();
};

}  // namespace hueline::drivers
