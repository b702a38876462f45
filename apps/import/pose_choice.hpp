#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/ros/ros_pose_message.hpp"

namespace hueline::apps {

/// What a recording's messages of one topic say of the pose.
struct PoseTopic {
  std::string type;                    ///< ros_type()
  std::string frame;                   ///< that they are the pose of, by the first message
  std::uint64_t usable = 0;            ///< messages that can be used (drivers::pose_stamp())
  std::uint64_t before_gps = 0;        ///< those of them whose stamps lie before the begin of GPS time
  std::optional<UnixTime> begin{};     ///< the earliest of their stamps
  std::optional<nanoseconds> delay{};  ///< the shortest time from a stamp to the recorder's time
};

/// The date from which the stamps of a simulator are counted, which begin at 0: 2020-01-01T00:00:00Z. Receivers cannot
/// express a time before 1980, and a date that every import gives is known for what it is.
constexpr UnixTime kSimulatorBegin{std::chrono::seconds(1'577'836'800)};

/// The topics from which the pose of a drive is taken. They are of one rank and of different kinds: two topics of one
/// kind would be two poses, and the vehicle would jump between them.
struct PoseChoice {
  drivers::RosPoseRank rank = drivers::RosPoseRank::None;
  std::vector<std::string> topics;  ///< one; of RosPoseRank::Part that of the positions and that of the orientations
  std::string frame;                ///< that stands for the vehicle's body
  std::map<std::string, std::string> not_used;  ///< why the other topics are not used, by their names
  bool is_by_stamp = false;                     ///< the times of the poses are header.stamp
  UnixTime begin{};                             ///< the earliest of these stamps
  nanoseconds delay{0};                         ///< the shortest time from such a stamp to the recorder's time
  /// Is added to the stamps: not 0 if most of them lie before the begin of GPS time, as those of a simulator do.
  nanoseconds shift{0};
};

/// Chooses among `found`, by their names. Of each kind that topic is taken which has the most messages that can be
/// used; of equal ones INSPVAX before INSPVA, because it has sigmas, and then the first by name. Of the kinds that of
/// the highest rank is taken. `wanted` names topics that are taken instead. `has_origin`: nav_msgs/Odometry can be
/// used. Errors: Invalid if `wanted` names a topic that cannot be used, or several that are not one pose.
Result<PoseChoice> choose_pose(const std::map<std::string, PoseTopic>& found, bool has_origin,
                               const std::vector<std::string>& wanted);

}  // namespace hueline::apps
