#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/buffer.hpp"
#include "core/frames.hpp"
#include "core/geodesy.hpp"
#include "drivers/ros/ros_course.hpp"
#include "drivers/ros/ros_message.hpp"
#include "drivers/ros/ros_pose_joiner.hpp"
#include "drivers/ros/ros_pose_message.hpp"

/// Positions and attitudes in messages of ROS, as the logs of a NovAtel receiver.
namespace hueline::drivers {

/// The way through the tree of frames from the vehicle's body to the world.
struct RosTransformPath {
  struct Step {
    std::string child, parent;
    std::optional<Eigen::Isometry3d> fixed;  ///< where it stays the same; nothing: messages say it
  };
  std::vector<Step> steps;  ///< from the body up; the first one moves
};

/// A position of the world that local poses are given in.
struct RosPlace {
  Geodetic place{};
  Eigen::Quaterniond q_enu_world = Eigen::Quaterniond::Identity();  ///< turns the world's axes to east, north and up
};

/// The world that local poses are given in.
struct RosWorld {
  RosMetres metres = RosMetres::AboutPlace;
  /// Returns where metres lie, or nothing if they are no place. Empty: nobody knows where the world lies.
  std::function<std::optional<RosPlace>(const Eigen::Vector3d&)> place{};
};
/// Returns the world whose axes are east, north and up of `origin`.
RosWorld world_about(const Geodetic& origin);

/// Makes logs of a receiver (novatel/wire.hpp) of the messages of one rank. Oem7RawMsg holds such logs, which are
/// taken as they are. Everything else becomes INSPVA, with INSSTDEV before it where sigmas are known:
/// - INSPVA(X): the values as they are; the time is the receiver's. INSSTDEV gives the sigmas of the solutions around.
/// - NavSatFix or GPSFix with the orientation of Imu, or of a local pose whose own position is not used: a pose at each
///   orientation between two fixes, whose position is interpolated (ros_pose_joiner.hpp). The height is taken for that
///   above the ellipsoid.
/// - Odometry, PoseStamped, PoseWithCovarianceStamped, PoseArray, TransformStamped, the transforms of tf along a
///   RosTransformPath: metres of a RosWorld. Their orientations are turned from its axes to the level and north of the
///   place: 7 km east of an origin at 50 degrees north, north differs by 0.08 deg and level by 0.06 deg.
/// The orientation is that of REP 103: the world is x east, y north, z up, the body x forward, y left, z up. The time
/// of the last two is header.stamp, taken for UTC, or the recorder's time if header.stamp is 0. The velocity of
/// the last one is that from the message before; the first one has that of the second.
/// Thread safety: none.
class RosPose {
 public:
  /// Bytes of logs, and when they count as received.
  struct Logs {
    UnixTime received{};
    Buffer bytes;
  };
  /// Messages that are whole, and of which no pose was made.
  struct Dropped {
    std::uint64_t late = 0;            ///< their stamps went back, or are there already
    std::uint64_t repeated = 0;        ///< local poses with the stamp of the one before, as tf sends them again
    std::uint64_t together = 0;        ///< local poses less than 0.5 ms behind another: nothing says their velocity
    std::uint64_t of_other_clock = 0;  ///< their stamps lie on the other side of the begin of GPS time
    std::uint64_t unplaced = 0;  ///< orientations without a position on either side within RosPoseJoiner::kLongestSpan
    std::uint64_t alone = 0;     ///< a local pose without a second one: it has no velocity
    std::uint64_t outside = 0;   ///< local poses whose metres are not those of the RosWorld, or no place of it
    std::uint64_t without_fix = 0;  ///< positions of a receiver that does not know its place
  };
  /// `shift` is added to the times that are header.stamp in the logs, not to when these count as received. Without it,
  /// stamps before the begin of GPS time are not used; with it, only they are. `path`: of the messages of tf that first
  /// step which moves gives the poses; one above it that moves too, as REP 105's map -> odom, counts until its next.
  RosPose(RosPoseRank rank, RosWorld world, nanoseconds shift = nanoseconds(0), RosTransformPath path = {})
      : rank_(rank), world_(std::move(world)), shift_(shift), path_(std::move(path)), steps_(path_.steps.size()) {}

  /// Takes a message of a type of the rank. Appends what it completes to `out`. Returns false if it is broken or says
  /// nothing that can be used.
  bool take(std::string_view type, RosReader message, UnixTime recorded, std::vector<Logs>& out);
  /// Appends what still waits for other messages. Call it after the last one.
  void finish(std::vector<Logs>& out);
  /// Returns what was dropped so far, by type of the message.
  const std::map<std::string, Dropped>& dropped() const { return dropped_; }
  /// Returns how the poses lie to the way that they drive; not those of a receiver, which looks after that itself.
  const RosCourse& course() const { return course_; }

 private:
  struct Pose {
    UnixTime time{};
    Geodetic place{};
    Eigen::Quaterniond q_enu_flu = Eigen::Quaterniond::Identity();
    std::optional<Eigen::Vector3d> sigma_enu, sigma_flu;
  };
  bool take_solution(std::string_view type, RosReader message, UnixTime recorded, std::vector<Logs>& out);
  bool take_part(std::string_view type, RosReader message, UnixTime recorded, std::vector<Logs>& out);
  void give_joined(std::vector<Logs>& out);
  bool take_transforms(std::string_view type, RosReader message, UnixTime recorded, std::vector<Logs>& out);
  bool take_local(std::string_view type, RosLocalPose pose, UnixTime recorded, std::vector<Logs>& out);
  bool settle(UnixTime& stamp, UnixTime recorded, std::string_view type);
  void give(const Pose& pose, const Eigen::Vector3d& velocity_enu, std::vector<Logs>& out);

  RosPoseRank rank_;
  RosWorld world_;
  nanoseconds shift_;
  RosTransformPath path_;
  std::vector<std::optional<Eigen::Isometry3d>> steps_;  // the latest of each step of the path
  std::optional<Pose> last_;
  RosPoseJoiner joiner_;
  std::string orientation_type_;  // of the messages that the joiner gets
  RosCourse course_;
  std::map<std::string, Dropped> dropped_;
};

}  // namespace hueline::drivers
