#pragma once

#include <deque>
#include <optional>
#include <string_view>
#include <vector>

#include "core/buffer.hpp"
#include "core/frames.hpp"
#include "core/geodesy.hpp"
#include "drivers/ros/ros_message.hpp"
#include "drivers/ros/ros_pose_message.hpp"

/// Positions and attitudes in messages of ROS, as the logs of a NovAtel receiver.
namespace hueline::drivers {

/// Makes logs of a receiver (novatel/wire.hpp) of the messages of one rank. Oem7RawMsg holds such logs, which are
/// taken as they are. Everything else becomes INSPVA, with INSSTDEV before it where sigmas are known:
/// - INSPVA(X): the values as they are; the time is the receiver's, from nov_header.
/// - NavSatFix with the orientation of Imu: a pose at each orientation between two fixes, whose position is
///   interpolated. NavSatFix gives the height above the ellipsoid.
/// - Odometry: metres east, north, up of the origin.
/// The orientation is that of REP 103: the world is x east, y north, z up, the body x forward, y left, z up. The time
/// of the last two is header.stamp, taken for UTC.
/// Thread safety: none.
class RosPose {
 public:
  /// Bytes of logs, and when they count as received.
  struct Logs {
    UnixTime received{};
    Buffer bytes;
  };
  RosPose(RosPoseRank rank, std::optional<Geodetic> origin) : rank_(rank), origin_(origin) {}

  /// Takes a message of a type of the rank. Appends what it completes to `out`. Returns false if it is broken or says
  /// nothing that can be used.
  bool take(std::string_view type, RosReader message, UnixTime recorded, std::vector<Logs>& out);

 private:
  struct Pose {
    UnixTime time{};
    Geodetic place{};
    Eigen::Quaterniond q_enu_flu = Eigen::Quaterniond::Identity();
    std::optional<Eigen::Vector3d> sigma_enu;
  };
  bool take_solution(std::string_view type, RosReader message, std::vector<Logs>& out);
  bool take_fix(RosReader message, std::vector<Logs>& out);
  bool take_imu(RosReader message);
  bool take_odometry(RosReader message, std::vector<Logs>& out);
  void give(const Pose& pose, const Eigen::Vector3d& velocity_enu, std::vector<Logs>& out) const;

  RosPoseRank rank_;
  std::optional<Geodetic> origin_;
  std::optional<Pose> last_;
  std::deque<RosOrientation> turns_;  // between the last fix and the next
};

}  // namespace hueline::drivers
