#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "drivers/ros/ros_pose.hpp"

namespace hueline::apps {

/// How the recorder's times go on beside the stamps of messages.
struct RecorderPace {
  std::optional<UnixTime> first_stamp{};
  UnixTime first_received{}, last_stamp{}, last_received{};
  void take(UnixTime stamp, UnixTime received);
  /// Returns whether the recorder's times go on faster or slower, by more than 2 s and a hundredth: those of a
  /// recording that was played at another speed, of a simulator that is not as fast as time, or of a program that
  /// wrote the messages when it had them. Such times do not tell when a message came.
  bool is_other() const;
};

/// What a recording's messages of one topic say of the pose.
struct PoseTopic {
  std::string type;                        ///< ros_type()
  std::string frame;                       ///< that they are the pose of, by the first message; empty: they do not say
  std::uint64_t usable = 0;                ///< messages that can be used (drivers::pose_time())
  std::uint64_t with_sigma = 0;            ///< those of them that state their accuracy
  std::uint64_t before_gps = 0;            ///< those of them whose times lie before the begin of GPS time
  std::optional<UnixTime> begin{}, end{};  ///< the earliest and the latest of their times
  std::optional<nanoseconds> delay{};      ///< from theirs to the recorder's time, where these are nearest
  std::optional<nanoseconds> shortest_delay{};  ///< the same, where the recorder's time is least behind or most ahead
  RecorderPace pace{}, pace_before_gps{};  ///< by header.stamp; of those before the begin of GPS time by themselves
  std::string world{};                     ///< of local poses the frame that they are given in
  double farthest_m = 0;                   ///< of local poses: from the origin
  std::optional<Eigen::Vector3d> first_place{};  ///< of local poses; nothing: of tf, whose transforms are joined later
  std::uint64_t of_other_metres = 0;  ///< local poses whose metres are not those of the survey (drivers::fits())
  std::uint64_t oriented = 0;         ///< of local poses: messages whose orientation can be used beside other positions
  std::uint64_t of_several = 0;       ///< messages with several poses, or none
  std::string why{};                  ///< why none of the messages can be used, where it is known
  drivers::RosTransformPath path{};   ///< of tf
};

/// The date from which the stamps of a simulator are counted, which begin at 0: 2020-01-01T00:00:00Z. Receivers cannot
/// express a time before 1980, and a date that every import gives is known for what it is.
constexpr UnixTime kSimulatorBegin{std::chrono::seconds(1'577'836'800)};

/// Times that are farther apart are of different clocks.
constexpr nanoseconds kSameClock = std::chrono::seconds(2);

/// The topics from which the pose of a drive is taken. They are of one rank and of different kinds: two topics of one
/// kind would be two poses, and the vehicle would jump between them.
struct PoseChoice {
  drivers::RosPoseRank rank = drivers::RosPoseRank::None;
  /// One, and that of the sigmas of solutions; of RosPoseRank::Part that of the positions and that of the orientations.
  std::vector<std::string> topics;
  std::string oriented_by{};  ///< the topic of local poses from which the orientations are; empty: none
  std::string frame;          ///< that stands for the vehicle's body
  std::string apart{};        ///< that the times of positions and orientations do not meet, a sentence; empty: they do
  std::map<std::string, std::string> not_used;  ///< why the other topics are not used, by their names
  bool is_by_stamp = false;                     ///< the times of the poses are header.stamp
  UnixTime begin{};                             ///< the earliest of them
  /// From the time of a pose to the recorder's, where these are nearest; for stamps of another clock where the message
  /// was the least under way.
  nanoseconds delay{0};
  bool is_sigma_known = true;                    ///< most of them state their accuracy, or their kind always does
  bool is_other_pace = false;                    ///< RecorderPace::is_other()
  bool is_height_known = true;                   ///< no position is of GPSFix, whose heights have any reference
  double farthest_m = 0;                         ///< PoseTopic::farthest_m
  std::optional<Eigen::Vector3d> first_place{};  ///< PoseTopic::first_place
  drivers::RosTransformPath path{};              ///< PoseTopic::path
  /// Is added to the stamps: not 0 if most of them lie before the begin of GPS time, as those of a simulator do.
  nanoseconds shift{0};

  /// How far the recorder's clock is ahead of that of the poses, as in a recording that was played and recorded again;
  /// 0 if it is the same, or if it cannot be known.
  nanoseconds recorder_ahead() const {
    return std::chrono::abs(delay) > kSameClock && !is_other_pace ? delay : nanoseconds(0);
  }
};

/// Chooses among `found`, by their names. Of each kind that topic is taken which has the most messages that can be
/// used; of equal ones INSPVAX before INSPVA, because it has sigmas, and then the first by name. INSPVA is taken with
/// INSSTDEV. Positions without an Imu that says an orientation at their times get that of a local pose. NavSatFix is
/// taken before GPSFix, and Odometry before other local poses, and these before tf, if it has a tenth of the messages
/// of the topic that has most. Of the kinds that of the highest rank is taken. `wanted` names topics that are taken
/// instead. `is_world_known`: local poses can be used, because their origin or their map is named. Errors: Invalid if
/// `wanted` names a topic that cannot be used, or several that are not one pose.
Result<PoseChoice> choose_pose(const std::map<std::string, PoseTopic>& found, bool is_world_known,
                               const std::vector<std::string>& wanted);

}  // namespace hueline::apps
