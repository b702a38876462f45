#pragma once

#include <optional>
#include <string_view>

#include "core/frames.hpp"
#include "core/geodesy.hpp"
#include "drivers/ros/ros_message.hpp"

/// What single messages of ROS say of a position or an orientation.
namespace hueline::drivers {

/// How much a message of this type (ros_type()) says about the pose. A recording's pose is taken from the best.
enum class RosPoseRank : std::uint8_t {
  None,
  Part,      ///< sensor_msgs/NavSatFix or Imu: together they are a pose
  Local,     ///< nav_msgs/Odometry: a pose about an origin that somebody has to name
  Solution,  ///< novatel_oem7_msgs/INSPVA, INSPVAX
  Logs,      ///< novatel_oem7_msgs/Oem7RawMsg: the receiver's own bytes
};
RosPoseRank pose_rank(std::string_view type);

/// An orientation of sensor_msgs/Imu: x east, y north, z up from x forward, y left, z up.
struct RosOrientation {
  UnixTime time{};
  Eigen::Quaterniond q_enu_flu = Eigen::Quaterniond::Identity();
};
/// A position of sensor_msgs/NavSatFix.
struct RosPosition {
  UnixTime time{};
  Geodetic place{};
  std::optional<Eigen::Vector3d> sigma_enu;  ///< m; nothing: the message states none
};
/// A pose of nav_msgs/Odometry.
struct RosLocalPose {
  UnixTime time{};
  Eigen::Vector3d enu = Eigen::Vector3d::Zero();  ///< m from the origin
  Eigen::Quaterniond q_enu_flu = Eigen::Quaterniond::Identity();
};

// These read a message of their type. They return nothing if it is broken or if it says that it does not know.
std::optional<RosOrientation> take_orientation(RosReader imu);
std::optional<RosPosition> take_position(RosReader nav_sat_fix);
std::optional<RosLocalPose> take_local_pose(RosReader odometry);

/// Takes nov_header of novatel_oem7_msgs (name, id, type, sequence, time status) up to the GPS week, and returns that.
std::uint16_t take_receiver_week(RosReader& in);

/// Returns the time of a message of a type that has a rank: that of a receiver's own clock where the message has it,
/// header.stamp elsewhere. Nothing if the message cannot be used for a pose.
std::optional<UnixTime> pose_time(std::string_view type, RosReader message);

}  // namespace hueline::drivers
