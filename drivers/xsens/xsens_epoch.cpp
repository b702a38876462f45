#include "drivers/xsens/xsens_epoch.hpp"

#include <cmath>
#include <utility>

#include "core/angle.hpp"
#include "core/portable_math.hpp"

namespace hueline::drivers {
namespace {

/// Body (right, forward, up) in the axes of the sensor (forward, left, up).
Eigen::Matrix3d sensor_from_body() {
  Eigen::Matrix3d out;
  out << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  return out;
}

}  // namespace

std::optional<ImuSample> XsensEpoch::sample() const {
  if (!time || !acceleration || !rate) return std::nullopt;
  const Eigen::Matrix3d R_body_sensor = sensor_from_body().transpose();
  ImuSample out;
  out.time = *time;
  out.specific_force_body = R_body_sensor * *acceleration;
  out.angular_rate_body = R_body_sensor * *rate;
  return out;
}

std::optional<InsSolution> XsensEpoch::solution() const {
  if (!time || !R_enu_sensor || !latitude_deg || !longitude_deg || !height_m || !velocity_enu) return std::nullopt;
  if (std::abs(*latitude_deg) > 90 || std::abs(*longitude_deg) > 180 || std::abs(*height_m) >= 1e5) return std::nullopt;
  InsSolution out;
  out.time = *time;
  out.position = {*latitude_deg * kRadPerDeg, *longitude_deg * kRadPerDeg, *height_m};
  out.velocity_enu = *velocity_enu;
  const Eigen::Matrix3d R_enu_body = R_enu_sensor->toRotationMatrix() * sensor_from_body();
  out.attitude = attitude_from_enu_body(Eigen::Quaterniond(R_enu_body));
  out.status = status.value_or(0);
  out.is_good = status && (*status & kFilterValid) != 0 && (*status & kGnssFix) != 0;
  return out;
}

std::uint64_t XsensCounter::take(std::uint16_t count) {
  const auto last = std::exchange(last_, count);
  const auto ahead = static_cast<std::uint16_t>(count - last.value_or(count));
  return ahead > 1 && ahead < 0x8000 ? std::uint64_t{ahead} - 1 : 0;
}

std::optional<Eigen::Quaterniond> xsens_quaternion(double w, double x, double y, double z) {
  const Eigen::Quaterniond q(w, x, y, z);
  if (!(std::abs(q.norm() - 1) <= 0.01)) return std::nullopt;
  return q.normalized();
}

Eigen::Quaterniond xsens_euler(double roll_deg, double pitch_deg, double yaw_deg) {
  using portable::rotation_about, Eigen::Vector3d;
  return rotation_about(Vector3d::UnitZ(), yaw_deg * kRadPerDeg) *
         rotation_about(Vector3d::UnitY(), pitch_deg * kRadPerDeg) *
         rotation_about(Vector3d::UnitX(), roll_deg * kRadPerDeg);
}

}  // namespace hueline::drivers
