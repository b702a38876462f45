#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/ros/ros_pose_message.hpp"

namespace hueline::apps {

/// What a recording's messages of one topic say of the pose.
struct PoseTopic {
  std::string type;          ///< ros_type()
  std::string frame;         ///< that they are the pose of, by the first message
  std::uint64_t usable = 0;  ///< messages that can be used (drivers::pose_stamp())
};

/// The topics from which the pose of a drive is taken. They are of one rank and of different kinds: two topics of one
/// kind would be two poses, and the vehicle would jump between them.
struct PoseChoice {
  drivers::RosPoseRank rank = drivers::RosPoseRank::None;
  std::vector<std::string> topics;  ///< one; of RosPoseRank::Part that of the positions and that of the orientations
  std::string frame;                ///< that stands for the vehicle's body
  std::map<std::string, std::string> not_used;  ///< why the other topics are not used, by their names
};

/// Chooses among `found`, by their names. Of each kind that topic is taken which has the most messages that can be
/// used; of equal ones INSPVAX before INSPVA, because it has sigmas, and then the first by name. Of the kinds that of
/// the highest rank is taken. `wanted` names topics that are taken instead. `has_origin`: nav_msgs/Odometry can be
/// used. Errors: Invalid if `wanted` names a topic that cannot be used, or several that are not one pose.
Result<PoseChoice> choose_pose(const std::map<std::string, PoseTopic>& found, bool has_origin,
                               const std::vector<std::string>& wanted);

}  // namespace hueline::apps
