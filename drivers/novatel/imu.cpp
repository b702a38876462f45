#include "drivers/novatel/imu.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/angle.hpp"
#include "core/portable_math.hpp"
#include "drivers/novatel/messages.hpp"

namespace hueline::drivers {
namespace {

constexpr double kMetresPerFoot = 0.3048;
constexpr double kStandardGravity = 9.80665;
constexpr double kEarthRate = 7.292115e-5;  // rad/s

/// Returns the WGS84 normal gravity (Somigliana's formula) with the free-air term, m/s^2.
double normal_gravity(const Geodetic& g) {
  const double s2 = portable::sin(g.latitude) * portable::sin(g.latitude);
  return 9.7803253359 * (1 + 0.00193185265241 * s2) / std::sqrt(1 - 0.00669437999013 * s2) -
         3.086e-6 * g.ellipsoidal_height;
}

Eigen::Vector3d three_doubles(std::span<const std::byte> bytes, std::size_t offset) {
  return {field<double>(bytes, offset), field<double>(bytes, offset + 8), field<double>(bytes, offset + 16)};
}

}  // namespace

std::optional<ImuScale> imu_scale(int imu_type) {
  const double epson_g320 = 0.008 / 65536 * kRadPerDeg, epson_g320_mps = 0.2 / 65536 * kStandardGravity / 1000;
  const double epson_g370 = 0.0151515 / 65536 * kRadPerDeg, epson_g370_mps = 0.4 / 65536 * kStandardGravity / 1000;
  const double arcsec = kRadPerDeg / 3600;
  switch (imu_type) {
    case 1:
    case 11:
      return ImuScale{100, std::ldexp(1.0, -33), std::ldexp(kMetresPerFoot, -27)};  // HG1700-AG11, AG58
    case 4:
    case 12:
      return ImuScale{100, std::ldexp(1.0, -33), std::ldexp(kMetresPerFoot, -26)};  // HG1700-AG17, AG62
    case 5:
    case 20:
    case 27:
    case 28:  // HG1900, HG1930
      return ImuScale{100, std::ldexp(1.0, -33), std::ldexp(kMetresPerFoot, -27)};
    case 8:
      return ImuScale{200, std::ldexp(1.0, -19), std::ldexp(1.0, -14)};  // LN-200
    case 13:
    case 16:
    case 33:
    case 45:  // iIMU-FSAS, KVH COTS, 1750, 1725
      return ImuScale{200, std::ldexp(0.1 * arcsec, -8), std::ldexp(0.05, -15)};
    case 26:
    case 52:
      return ImuScale{200, 1e-9, 2e-8};  // ISA-100C, uIMU-IC
    case 31:
      return ImuScale{200, std::ldexp(720 * kRadPerDeg, -31), std::ldexp(200.0, -31)};  // ADIS16488
    case 32:
    case 56:
      return ImuScale{125, std::ldexp(kRadPerDeg, -21), std::ldexp(1.0, -22)};  // STIM300
    case 41:
      return ImuScale{125, epson_g320 / 125, epson_g320_mps / 125};
    case 62:
      return ImuScale{200, epson_g320 / 200, epson_g320_mps / 200};
    case 61:
      return ImuScale{200, epson_g370 / 200, epson_g370_mps / 200};
    case 58:
    case 68:
      return ImuScale{100, std::ldexp(1.0, -33), std::ldexp(1.0, -29)};  // HG4930
    case 69:
      return ImuScale{400, std::ldexp(1.0, -33), std::ldexp(1.0, -29)};
    default:
      return {};
  }
}

std::string NovatelImu::Config::validate() const {
  if (imu_type < 0 || imu_type > 255) return "imu_type must be 0 .. 255";
  if (!(rate_hz >= 0) || rate_hz > 2000) return "rate_hz must be 0 .. 2000";
  if (!(rad_per_count >= 0) || rad_per_count > 1) return "rad_per_count must be 0 .. 1";
  if (!(mps_per_count >= 0) || mps_per_count > 1) return "mps_per_count must be 0 .. 1";
  if (!(corrimudata_rate_hz >= 0) || corrimudata_rate_hz > 200) return "corrimudata_rate_hz must be 0 .. 200";
  if (!(longest_attitude_age_s > 0) || longest_attitude_age_s > 10)
    return "longest_attitude_age_s must be above 0, up to 10";
  for (const double angle : rotation_rbv_deg)
    if (!(std::abs(angle) <= 360)) return "rotation_rbv_deg must be three angles within -360 .. 360";
  return {};
}

NovatelImu::NovatelImu(const Config& config) : config_(config) {
  // RBV turns the axes of the IMU frame about z, then the new x, then the new y, into the axes of the vehicle frame.
  // The product of these rotations has the vehicle's axes in IMU coordinates as its columns.
  using portable::rotation_about, Eigen::Vector3d;
  const auto& a = config_.rotation_rbv_deg;
  const Eigen::Matrix3d R_imu_body =
      (rotation_about(Vector3d::UnitZ(), a[2] * kRadPerDeg) * rotation_about(Vector3d::UnitX(), a[0] * kRadPerDeg) *
       rotation_about(Vector3d::UnitY(), a[1] * kRadPerDeg))
          .toRotationMatrix();
  R_body_imu_ = R_imu_body.transpose();
  learn_type(config_.imu_type);
}

void NovatelImu::learn_type(int imu_type) {
  if (config_.imu_type != 0) imu_type = config_.imu_type;
  scale_ = imu_scale(imu_type).value_or(ImuScale{});
  if (config_.rate_hz > 0) scale_.rate_hz = config_.rate_hz;
  if (config_.rad_per_count > 0) scale_.rad_per_count = config_.rad_per_count;
  if (config_.mps_per_count > 0) scale_.mps_per_count = config_.mps_per_count;
}

void NovatelImu::learn_attitude(const InsSolution& solution) {
  if (!has_ins_attitude(solution.status)) return;
  has_attitude_ = true;
  attitude_time_ = solution.time;
  R_body_enu_ = rotation_enu_body(solution.attitude).toRotationMatrix().transpose();
  gravity_enu_ = {0, 0, normal_gravity(solution.position)};
  earth_rate_enu_ = kEarthRate * Eigen::Vector3d(0, portable::cos(solution.position.latitude),
                                                 portable::sin(solution.position.latitude));
}

std::optional<ImuSample> NovatelImu::decode_rawimu(std::span<const std::byte> body) const {
  const auto time = novatel_time(field<std::uint32_t>(body, 0), field<double>(body, 4));
  return time ? from_counts(*time, body.subspan(16)) : std::nullopt;
}

std::optional<ImuSample> NovatelImu::decode_rawimux(std::span<const std::byte> body) {
  learn_type(field<std::uint8_t>(body, 1));
  constexpr std::uint8_t kImuError = 0x01;
  if (field<std::uint8_t>(body, 0) & kImuError) return {};
  const auto time = novatel_time(field<std::uint16_t>(body, 2), field<double>(body, 4));
  return time ? from_counts(*time, body.subspan(16)) : std::nullopt;
}

std::optional<ImuSample> NovatelImu::from_counts(GpsTime time, std::span<const std::byte> counts) const {
  if (scale_.rate_hz <= 0 || scale_.rad_per_count <= 0 || scale_.mps_per_count <= 0) return {};
  const auto three = [&](std::size_t offset) {
    return Eigen::Vector3d(field<std::int32_t>(counts, offset + 8),
                           -static_cast<double>(field<std::int32_t>(counts, offset + 4)),
                           field<std::int32_t>(counts, offset));
  };
  ImuSample out;
  out.time = time;
  out.specific_force_body = R_body_imu_ * three(0) * (scale_.mps_per_count * scale_.rate_hz);
  out.angular_rate_body = R_body_imu_ * three(12) * (scale_.rad_per_count * scale_.rate_hz);
  return out;
}

std::optional<ImuSample> NovatelImu::decode_corrimudata(std::span<const std::byte> body) const {
  const auto time = novatel_time(field<std::uint32_t>(body, 0), field<double>(body, 4));
  return time ? from_corrected(*time, config_.corrimudata_rate_hz, body.subspan(12)) : std::nullopt;
}

std::optional<ImuSample> NovatelImu::decode_corrimus(const NovatelHeader& header,
                                                     std::span<const std::byte> body) const {
  const auto time = header_time(header);
  const auto samples = field<std::uint32_t>(body, 0);
  if (!time || samples == 0) return {};
  return from_corrected(*time, scale_.rate_hz / samples, body.subspan(4));
}

std::optional<ImuSample> NovatelImu::decode_imuratecorrimus(std::span<const std::byte> body) const {
  const auto time = novatel_time(field<std::uint32_t>(body, 0), field<double>(body, 4));
  return time ? from_corrected(*time, scale_.rate_hz, body.subspan(12)) : std::nullopt;
}

std::optional<ImuSample> NovatelImu::from_corrected(GpsTime time, double per_second,
                                                    std::span<const std::byte> increments) const {
  const auto age = std::chrono::abs(time - attitude_time_);
  if (per_second <= 0 || !has_attitude_ || age > from_seconds(config_.longest_attitude_age_s)) return {};
  // The pitch rate is about x, the roll rate about y, the yaw rate about z. Lateral is x, longitudinal y, vertical z.
  const Eigen::Vector3d rate = three_doubles(increments, 0) * per_second,
                        acceleration = three_doubles(increments, 24) * per_second;
  if (!rate.allFinite() || !acceleration.allFinite()) return {};
  ImuSample out;
  out.time = time;
  out.specific_force_body = acceleration + R_body_enu_ * gravity_enu_;
  out.angular_rate_body = rate + R_body_enu_ * earth_rate_enu_;
  return out;
}

}  // namespace hueline::drivers
