#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/frames.hpp"
#include "core/geodesy.hpp"
#include "drivers/ros/ros_message.hpp"

/// What single messages of ROS say of a position or an orientation.
namespace hueline::drivers {

/// How much a message of this type (ros_type()) says about the pose. A recording's pose is taken from the best.
enum class RosPoseRank : std::uint8_t {
  None,
  Part,      ///< a position (sensor_msgs/NavSatFix, GPSFix) or sensor_msgs/Imu: together they are a pose
  Local,     ///< Odometry, PoseStamped, PoseWithCovarianceStamped, PoseArray, TransformStamped, tf: a pose about an
             ///< origin that somebody has to name
  Solution,  ///< INSPVA and INSPVAX of NovAtel's drivers, and the sigmas in INSSTDEV (ros_solution.hpp)
  Logs,      ///< novatel_oem7_msgs/Oem7RawMsg: the receiver's own bytes
};
RosPoseRank pose_rank(std::string_view type);

/// What messages of a type say of the pose. One topic for each of these is enough.
enum class RosPosePart : std::uint8_t {
  Whole,        ///< all of it
  Position,     ///< sensor_msgs/NavSatFix, GPSFix
  Orientation,  ///< sensor_msgs/Imu
  Sigmas,       ///< those of solutions in other messages
};
RosPosePart pose_part(std::string_view type);

/// Returns whether this type (ros_type()) is GPSFix of gps_common or gps_msgs.
bool is_gps_fix(std::string_view type);
/// Returns whether messages of this type are those of tf, which hold the transforms of many frames.
bool carries_transforms(std::string_view type);

/// An orientation of sensor_msgs/Imu, or of a local pose: x east, y north, z up from x forward, y left, z up.
struct RosOrientation {
  UnixTime time{};
  Eigen::Quaterniond q_enu_flu = Eigen::Quaterniond::Identity();
};
/// A position of sensor_msgs/NavSatFix or GPSFix.
struct RosPosition {
  UnixTime time{};
  Geodetic place{};
  std::optional<Eigen::Vector3d> sigma_enu;  ///< m; nothing: the message states none
};
/// What the metres of local poses count from.
enum class RosMetres : std::uint8_t {
  AboutPlace,  ///< an origin near the drive: they are less than kFarthest_m
  OfMap,       ///< the zero of a map's coordinates (UTM), which is more than kNearestOfMap_m from any drive
  Any,         ///< anything: the position is not asked for
};
constexpr double kFarthest_m = 1e6, kNearestOfMap_m = 20e3, kFarthestOfMap_m = 30e6;
/// Returns whether a position may be one of these metres.
bool fits(RosMetres metres, const Eigen::Vector3d& position);
/// A pose of nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped, PoseArray or TransformStamped.
struct RosLocalPose {
  UnixTime time{};
  std::string frame;                              ///< that the pose is given in
  std::string body;                               ///< that it is the pose of; empty: the message does not say it
  Eigen::Vector3d enu = Eigen::Vector3d::Zero();  ///< m along the axes of the world, which are a map's if it is one
  Eigen::Quaterniond q_enu_flu = Eigen::Quaterniond::Identity();
  std::optional<Eigen::Vector3d> sigma_enu;  ///< m; nothing: the message states none
  std::optional<Eigen::Vector3d> sigma_flu;  ///< rad, of turns about the axes of the body: roll, pitch, yaw
};
/// A transform of tf: the place and the orientation of the frame `child` in `parent`.
struct RosTransform {
  UnixTime time{};
  std::string parent, child;  ///< without the slash with which ROS 1's first tf began
  Eigen::Isometry3d T_parent_child = Eigen::Isometry3d::Identity();
};

// These read a message of their type. They return nothing if it is broken or if it says that it does not know.
/// Of a local pose its position is not looked at.
std::optional<RosOrientation> take_orientation(std::string_view type, RosReader message);
/// A latitude and longitude of exactly 0 are those of a receiver that does not know its place yet.
std::optional<RosPosition> take_position(std::string_view type, RosReader message);
/// Returns whether a message of a position is whole and says that its receiver does not know its place.
bool is_without_fix(std::string_view type, RosReader message);
/// A position that does not fit `metres` is not read, nor is a PoseArray that has not exactly one pose: it does not say
/// which of them is the vehicle's.
std::optional<RosLocalPose> take_local_pose(std::string_view type, RosReader message, RosMetres metres);
/// Transforms that are none (numbers that are not finite, a rotation whose length is not 1) are left out.
std::optional<std::vector<RosTransform>> take_transforms(RosReader message);
/// Returns whether a message of Odometry or of a stamped pose says a position that does not fit `metres`.
bool is_of_other_metres(std::string_view type, RosReader message, RosMetres metres);
/// Returns whether a message of a position or a local pose states its accuracy.
bool states_accuracy(std::string_view type, RosReader message, RosMetres metres);

/// Returns `frame` without the slash with which ROS 1's first tf began.
std::string without_slash(std::string frame);

/// Returns the time of a message of a type that has a rank: that of a receiver's own clock where the message has it,
/// header.stamp elsewhere. Nothing if the message cannot be used for a pose. Messages of tf have no time of their own.
std::optional<UnixTime> pose_time(std::string_view type, RosReader message, RosMetres metres);

}  // namespace hueline::drivers
