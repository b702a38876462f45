#include "drivers/ros/ros_pose_message.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "core/calendar.hpp"
#include "drivers/ros/ros_solution.hpp"

namespace hueline::drivers {
namespace {

Eigen::Quaterniond take_quaternion(RosReader& in) {
  const auto x = in.take<double>(), y = in.take<double>(), z = in.take<double>(), w = in.take<double>();
  return {w, x, y, z};
}
bool is_rotation(const Eigen::Quaterniond& q) { return std::abs(q.norm() - 1) < 0.01; }

// Drivers that know no covariance say so with zeros, -1 or numbers that are none, whatever its kind says; others with
// large ones.
std::optional<Eigen::Vector3d> sigma_of(const Eigen::Vector3d& variance, double largest) {
  if (!variance.allFinite() || !(variance.minCoeff() > 0) || variance.maxCoeff() > largest * largest) return {};
  return variance.cwiseSqrt();
}

/// Reads the covariance of a pose: metres along the axes of the world, then turns about them, rad.
void take_pose_covariance(RosReader& in, RosLocalPose& out) {
  constexpr double kLargest_m = 1000, kLargest_rad = 1;
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> covariance;
  for (double& value : covariance.reshaped<Eigen::RowMajor>()) value = in.take<double>();
  if (!in.ok()) return;
  out.sigma_enu = sigma_of(covariance.diagonal().head<3>(), kLargest_m);
  const Eigen::Matrix3d turned = out.q_enu_flu.toRotationMatrix();
  const Eigen::Matrix3d about_body = turned.transpose() * covariance.bottomRightCorner<3, 3>() * turned;
  if (sigma_of(covariance.diagonal().tail<3>(), kLargest_rad))
    out.sigma_flu = sigma_of(about_body.diagonal(), kLargest_rad);
}

UnixTime time_of_receiver(std::uint16_t week, std::uint32_t ms) {
  return to_unix(from_gps_week(week, std::chrono::milliseconds(ms)));
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

void take_numbers(RosReader& in) { in.take_bytes(std::uint64_t{4} * in.take_count(4)); }

/// Reads the GPSStatus in a GPSFix. Returns its status, which is negative without a fix.
int take_gps_status(RosReader& in) {
  in.take_header();
  in.take<std::uint16_t>();  // satellites used
  take_numbers(in);
  in.take<std::uint16_t>();  // satellites in view, their numbers, elevations, azimuths and strengths
  for (int i = 0; i < 4; ++i) take_numbers(in);
  const int status = in.take<std::int16_t>();
  for (int i = 0; i < 3; ++i) in.take<std::uint16_t>();  // sources of motion, orientation and position
  return status;
}

/// What a NavSatFix or a GPSFix says. It may be broken: ask the reader.
struct PositionMessage {
  RosPosition position;
  bool has_fix = false;
};
PositionMessage take_position_message(std::string_view type, RosReader& in) {
  PositionMessage out;
  out.position.time = in.take_header().stamp;
  const bool is_fix = is_gps_fix(type);
  const int status = is_fix ? take_gps_status(in) : in.take<std::int8_t>();
  if (!is_fix) in.take<std::uint16_t>();
  out.position.place.latitude = in.take<double>() * (std::numbers::pi / 180);
  out.position.place.longitude = in.take<double>() * (std::numbers::pi / 180);
  out.position.place.ellipsoidal_height = in.take<double>();
  // Course, speed, orientation, time, dilutions of precision and errors that another program may mean otherwise.
  constexpr int kOtherValues = 22;
  for (int i = 0; is_fix && i < kOtherValues; ++i) in.take<double>();
  std::array<double, 9> covariance{};
  for (double& value : covariance) value = in.take<double>();
  const bool has_covariance = in.take<std::uint8_t>() != 0;
  const Geodetic& place = out.position.place;
  const bool is_known = std::isfinite(place.latitude) && std::isfinite(place.longitude);
  out.has_fix = status >= 0 && is_known && (place.latitude != 0 || place.longitude != 0);
  if (has_covariance)
    out.position.sigma_enu =
        sigma_of({covariance[0], covariance[4], covariance[8]}, std::numeric_limits<double>::max());
  return out;
}

template <class T>
std::optional<UnixTime> time_of(const std::optional<T>& message) {
  return message ? std::optional(message->time) : std::nullopt;
}

/// Returns whether a local pose begins with two frames, its world and its body.
bool names_body(std::string_view type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/TransformStamped";
}
constexpr std::string_view kPoseArray = "geometry_msgs/PoseArray";

/// Reads what stands before the position of a local pose. Returns false if there is not exactly one.
bool take_local_head(std::string_view type, RosReader& in, RosLocalPose& out) {
  constexpr std::size_t kPoseBytes = 7 * 8;
  const RosHeader header = in.take_header();
  out.time = header.stamp;
  out.frame = without_slash(header.frame);
  if (names_body(type)) out.body = without_slash(in.take_string());
  return type != kPoseArray || in.take_count(kPoseBytes) == 1;
}

}  // namespace

RosPoseRank pose_rank(std::string_view type) {
  if (type == "novatel_oem7_msgs/Oem7RawMsg") return RosPoseRank::Logs;
  if (carries_solution(type) || carries_solution_sigmas(type)) return RosPoseRank::Solution;
  if (names_body(type) || type == "geometry_msgs/PoseStamped" || type == "geometry_msgs/PoseWithCovarianceStamped" ||
      type == kPoseArray || carries_transforms(type))
    return RosPoseRank::Local;
  if (type == "sensor_msgs/NavSatFix" || is_gps_fix(type) || type == "sensor_msgs/Imu") return RosPoseRank::Part;
  return RosPoseRank::None;
}

RosPosePart pose_part(std::string_view type) {
  if (carries_solution_sigmas(type)) return RosPosePart::Sigmas;
  if (pose_rank(type) != RosPoseRank::Part) return RosPosePart::Whole;
  return type == "sensor_msgs/Imu" ? RosPosePart::Orientation : RosPosePart::Position;
}

bool is_gps_fix(std::string_view type) { return type == "gps_msgs/GPSFix" || type == "gps_common/GPSFix"; }

bool carries_transforms(std::string_view type) { return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage"; }

std::string without_slash(std::string frame) {
  if (frame.starts_with('/')) frame.erase(0, 1);
  return frame;
}

std::optional<RosOrientation> take_orientation(std::string_view type, RosReader in) {
  RosLocalPose head;
  if (!take_local_head(type, in, head)) return {};
  const bool is_local = pose_rank(type) == RosPoseRank::Local;
  for (int axis = 0; is_local && axis < 3; ++axis) in.take<double>();
  RosOrientation out;
  out.time = head.time;
  out.q_enu_flu = take_quaternion(in);
  // By its definition, an Imu without orientation says so with a covariance of -1.
  const bool is_without = !is_local && in.take<double>() == -1;
  if (!in.ok() || is_without || !is_rotation(out.q_enu_flu)) return {};
  out.q_enu_flu.normalize();
  return out;
}

std::optional<RosPosition> take_position(std::string_view type, RosReader in) {
  const PositionMessage message = take_position_message(type, in);
  return in.ok() && message.has_fix && is_on_earth(message.position.place) ? std::optional(message.position)
                                                                           : std::nullopt;
}

bool is_without_fix(std::string_view type, RosReader in) {
  const PositionMessage message = take_position_message(type, in);
  return in.ok() && !message.has_fix;
}

bool fits(RosMetres metres, const Eigen::Vector3d& position) {
  const double far = position.norm();
  if (metres == RosMetres::Any) return true;
  return metres == RosMetres::AboutPlace ? far < kFarthest_m : far >= kNearestOfMap_m && far < kFarthestOfMap_m;
}

std::optional<RosLocalPose> take_local_pose(std::string_view type, RosReader in, RosMetres metres) {
  RosLocalPose out;
  if (!take_local_head(type, in, out)) return {};
  for (double& value : out.enu) value = in.take<double>();
  out.q_enu_flu = take_quaternion(in);
  if (!in.ok() || !is_rotation(out.q_enu_flu) || !fits(metres, out.enu)) return {};
  out.q_enu_flu.normalize();
  if (type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseWithCovarianceStamped") take_pose_covariance(in, out);
  return out;
}

std::optional<std::vector<RosTransform>> take_transforms(RosReader in) {
  std::vector<RosTransform> out;
  const std::uint32_t count = in.take_count(8 * 7);
  for (std::uint32_t i = 0; i < count; ++i) {
    RosTransform one;
    const RosHeader header = in.take_header();
    one.time = header.stamp;
    one.parent = without_slash(header.frame);
    one.child = without_slash(in.take_string());
    for (double& value : one.T_parent_child.translation()) value = in.take<double>();
    const Eigen::Quaterniond q = take_quaternion(in);
    if (!in.ok()) return {};
    if (!one.T_parent_child.translation().allFinite() || !is_rotation(q)) continue;
    one.T_parent_child.linear() = q.normalized().toRotationMatrix();
    out.push_back(std::move(one));
  }
  return out;
}

bool is_of_other_metres(std::string_view type, RosReader in, RosMetres metres) {
  RosLocalPose head;
  if (!take_local_head(type, in, head)) return false;
  Eigen::Vector3d place;
  for (double& value : place) value = in.take<double>();
  return in.ok() && place.allFinite() && !fits(metres, place);
}

bool states_accuracy(std::string_view type, RosReader message, RosMetres metres) {
  if (pose_rank(type) == RosPoseRank::Local) {
    const auto pose = carries_transforms(type) ? std::nullopt : take_local_pose(type, message, metres);
    return pose && pose->sigma_enu;
  }
  const auto position = pose_part(type) == RosPosePart::Position ? take_position(type, message) : std::nullopt;
  return position && position->sigma_enu;
}

std::optional<UnixTime> pose_time(std::string_view type, RosReader message, RosMetres metres) {
  switch (pose_rank(type)) {
    case RosPoseRank::Logs:
      return time_of_log(message);
    case RosPoseRank::Solution:
      if (const auto solution = take_solution(type, message)) return to_unix(solution->time);
      return {};
    case RosPoseRank::Local:
      if (carries_transforms(type)) return {};
      return time_of(take_local_pose(type, message, metres));
    case RosPoseRank::Part:
      return pose_part(type) == RosPosePart::Orientation ? time_of(take_orientation(type, message))
                                                         : time_of(take_position(type, message));
    case RosPoseRank::None:
      break;
  }
  return {};
}

}  // namespace hueline::drivers
