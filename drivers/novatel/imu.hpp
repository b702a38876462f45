#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/measurements.hpp"
#include "drivers/novatel/wire.hpp"

/// Converts SPAN's inertial increments to specific force and angular rate in Body.
namespace hueline::drivers {

/// The unit of a count of RAWIMU, and the sample rate. Source: the table "Raw IMU Scale Factors" and the rates of
/// RAWIMUSX in the OEM7 manual.
struct ImuScale {
  double rate_hz = 0;
  double rad_per_count = 0;
  double mps_per_count = 0;  ///< metres per second
};
/// Returns the scale of an IMU by NovAtel's type number (INSCONFIG, RAWIMUX). Returns nothing for a type that is not in
/// the table.
std::optional<ImuScale> imu_scale(int imu_type);

/// Makes an ImuSample of raw and of corrected messages, with the same meaning for both. Raw messages hold counts of one
/// sample in the order z, -y, x, in the IMU's own frame. Corrected messages hold radians and m/s in the vehicle frame,
/// from which the receiver has removed gravity and the earth's rotation; both are added again with the latest attitude.
/// The result depends on the messages only.
/// Thread safety: none; one thread calls all functions.
class NovatelImu {
 public:
  struct Config {
    int imu_type = 0;                ///< NovAtel's number; 0 takes it from RAWIMUX or INSCONFIG
    double rate_hz = 0;              ///< samples a second; 0 takes it from the type
    double rad_per_count = 0;        ///< 0 takes it from the type
    double mps_per_count = 0;        ///< metres per second; 0 takes it from the type
    double corrimudata_rate_hz = 0;  ///< logging rate of CORRIMUDATA(S); 0 ignores these messages
    /// Rotation from the IMU frame to the vehicle frame about x, y and z, degrees: the numbers of SETINSROTATION RBV.
    /// The axes are turned in the order z, x, y. For raw messages only.
    std::array<double, 3> rotation_rbv_deg{0, 0, 0};
    double longest_attitude_age_s = 0.2;  ///< largest age of the attitude with which gravity is added again
    /// Returns an empty text if all values are allowed, else which key is outside which range.
    std::string validate() const;
  };

  explicit NovatelImu(const Config& config);

  /// Sets the type of the IMU, unless the Config names it.
  void learn_type(int imu_type);
  /// Takes the attitude and position of a solution, unless its status says that they mean nothing. They replace earlier
  /// ones.
  void learn_attitude(const InsSolution& solution);
  /// Forgets the attitude, because the stream was interrupted.
  void forget() { has_attitude_ = false; }

  /// These functions decode the body of the message in their name. They return nothing if the scale, the rate or the
  /// attitude that they need is not known, if RAWIMUX reports an error of the IMU, or if a field has an impossible
  /// value.
  std::optional<ImuSample> decode_rawimu(std::span<const std::byte> body) const;
  /// Decodes a sample, after it has learned the type that the message names.
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
