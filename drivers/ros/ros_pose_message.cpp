#include "drivers/ros/ros_pose_message.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>

#include "core/calendar.hpp"

namespace hueline::drivers {
namespace {

Eigen::Quaterniond take_quaternion(RosReader& in) {
  const auto x = in.take<double>(), y = in.take<double>(), z = in.take<double>(), w = in.take<double>();
  return {w, x, y, z};
}
bool is_rotation(const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1) < 0.01; }

UnixTime time_of_receiver(std::uint16_t week, std::uint32_t ms) {
  return to_unix(from_gps_week(week, std::chrono::milliseconds(ms)));
}

/// A solution of a receiver that does not know its week has no time.
std::optional<UnixTime> time_of_solution(RosReader in) {
  in.take_header();
  const auto week = take_receiver_week(in);
  const auto ms = in.take<std::uint32_t>();
  return in.ok() && week != 0 ? std::optional(time_of_receiver(week, ms)) : std::nullopt;
}

/// Only the binary form of a log has its time at a known place. The others are taken at their stamp.
std::optional<UnixTime> time_of_log(RosReader in) {
  const RosHeader header = in.take_header();
  const auto log = in.take_byte_sequence();
  if (!in.ok()) return {};
  constexpr std::array kBegin{std::byte{0xAA}, std::byte{0x44}, std::byte{0x12}};
  constexpr std::size_t kWeek = 14, kMilliseconds = 16, kEnd = 20;
  std::uint16_t week = 0;
  std::uint32_t ms = 0;
  if (log.size() < kEnd || !std::equal(kBegin.begin(), kBegin.end(), log.begin())) return header.stamp;
  std::memcpy(&week, &log[kWeek], sizeof week);
  std::memcpy(&ms, &log[kMilliseconds], sizeof ms);
  return week != 0 ? time_of_receiver(week, ms) : header.stamp;
}

template <class T>
std::optional<UnixTime> time_of(const std::optional<T>& message) {
  return message ? std::optional(message->time) : std::nullopt;
}

}  // namespace

std::uint16_t take_receiver_week(RosReader& in) {
  in.take_string();
  in.take<std::uint16_t>();
  in.take<std::uint8_t>();
  in.take<std::uint32_t>();
  in.take<std::uint8_t>();
  return in.take<std::uint16_t>();
}

RosPoseRank pose_rank(std::string_view type) {
  if (type == "novatel_oem7_msgs/Oem7RawMsg") return RosPoseRank::Logs;
  if (type == "novatel_oem7_msgs/INSPVAX" || type == "novatel_oem7_msgs/INSPVA") return RosPoseRank::Solution;
  if (type == "nav_msgs/Odometry") return RosPoseRank::Local;
  if (type == "sensor_msgs/NavSatFix" || type == "sensor_msgs/Imu") return RosPoseRank::Part;
  return RosPoseRank::None;
}

std::optional<RosOrientation> take_orientation(RosReader in) {
  RosOrientation out;
  out.time = in.take_header().stamp;
  out.q_enu_flu = take_quaternion(in);
  const auto covariance = in.take<double>();
  // By its definition, a sensor without orientation says so with a covariance of -1.
  if (!in.ok() || covariance == -1 || !is_rotation(out.q_enu_flu)) return {};
  out.q_enu_flu.normalize();
  return out;
}

std::optional<RosPosition> take_position(RosReader in) {
  RosPosition out;
  out.time = in.take_header().stamp;
  const auto status = in.take<std::int8_t>();
  in.take<std::uint16_t>();
  out.place.latitude = in.take<double>() * (std::numbers::pi / 180);
  out.place.longitude = in.take<double>() * (std::numbers::pi / 180);
  out.place.ellipsoidal_height = in.take<double>();
  std::array<double, 9> covariance{};
  for (double& value : covariance) value = in.take<double>();
  const bool has_covariance = in.take<std::uint8_t>() != 0;
  if (!in.ok() || status < 0 || !is_on_earth(out.place)) return {};
  // Drivers that know no covariance also say so with zeros, -1 or numbers that are none, whatever the kind says.
  const Eigen::Vector3d variance(covariance[0], covariance[4], covariance[8]);
  if (has_covariance && variance.allFinite() && variance.minCoeff() > 0) out.sigma_enu = variance.cwiseSqrt();
  return out;
}

std::optional<RosLocalPose> take_local_pose(RosReader in) {
  RosLocalPose out;
  out.time = in.take_header().stamp;
  in.take_string();
  for (double& value : out.enu) value = in.take<double>();
  out.q_enu_flu = take_quaternion(in);
  if (!in.ok() || !is_rotation(out.q_enu_flu) || !(out.enu.norm() < 1e6)) return {};
  out.q_enu_flu.normalize();
  return out;
}

std::optional<UnixTime> pose_time(std::string_view type, RosReader message) {
  switch (pose_rank(type)) {
    case RosPoseRank::Logs:
      return time_of_log(message);
    case RosPoseRank::Solution:
      return time_of_solution(message);
    case RosPoseRank::Local:
      return time_of(take_local_pose(message));
    case RosPoseRank::Part:
      return type == "sensor_msgs/Imu" ? time_of(take_orientation(message)) : time_of(take_position(message));
    case RosPoseRank::None:
      break;
  }
  return {};
}

}  // namespace hueline::drivers
