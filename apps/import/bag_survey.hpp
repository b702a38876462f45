#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/import/camera_choice.hpp"
#include "apps/import/camera_lens.hpp"
#include "apps/import/pose_choice.hpp"
#include "core/frames.hpp"
#include "core/result.hpp"
#include "drivers/ros/ros_cloud_decoder.hpp"
#include "drivers/ros/ros_message.hpp"
#include "rosbag/bag.hpp"

namespace hueline::apps {

/// The tree of frames that do not move against each other: those of /tf_static, and those of /tf whose transform stays
/// the same, as tf's static_transform_publisher sends it.
class FrameTree {
 public:
  static constexpr std::size_t kMostFrames = 10'000;
  /// Takes the transforms of a tf2_msgs/TFMessage. `is_static`: of /tf_static.
  void take(const std::vector<drivers::RosTransform>& transforms, bool is_static);
  /// Returns the place of frame `of` in frame `in`, or nothing if the tree does not join them.
  std::optional<Eigen::Isometry3d> place(const std::string& of, const std::string& in) const;
  bool has(const std::string& frame) const;
  /// Returns the way from `frame` up to the root.
  drivers::RosTransformPath path_up(const std::string& frame) const;
  /// Returns the frames whose names end with `ending`.
  std::set<std::string> ending_with(const std::string& ending) const;

 private:
  static constexpr std::size_t kDeepest = 100;  // a circle ends here
  struct Parent {
    std::string frame;
    Eigen::Isometry3d T_parent_child;
    bool is_static = false, moves = false;
  };
  std::vector<std::pair<std::string, Eigen::Isometry3d>> to_root(const std::string& frame) const;
  std::map<std::string, Parent> parents_;  // by child
};

/// The transforms of a topic of tf, by the child.
using TreeLinks = std::map<std::string, PoseTopic>;

/// Returns whether a frame does not move with the vehicle, by REP 105 and habit; the vehicle's name may stand before
/// it.
bool is_standing(std::string_view frame);

/// What one reading of a recording tells of its topics, before anything is written.
struct BagSurvey {
  /// The point clouds of one topic.
  struct Cloud {
    /// How they are read (RosCloudDecoder::suited); nothing: no message of it has a return.
    std::optional<drivers::RosCloudDecoder::Config> config;
    std::string frame;
    std::size_t points = 0;  ///< of the largest of the first messages
    /// The shortest time from a message's last point to the recorder's time; negative if stamps are ahead of it.
    std::optional<nanoseconds> delay;
    std::string fields;  ///< their names, of a PointCloud2
    std::string why;     ///< why its messages cannot be read
  };
  std::map<std::string, CameraTopic> cameras;  ///< by topic, without has_lens
  std::map<std::string, Cloud> clouds;         ///< by topic
  std::map<std::string, CameraFacts> facts;    ///< by topic of CameraInfo
  std::map<std::string, std::string> frames;   ///< of each scanner's first message with a header, by topic
  std::map<std::string, PoseTopic> poses;      ///< by topic
  FrameTree tree;
  /// The longest way back from one message to a later one, by the recorder's times, among those that a drive is made
  /// of.
  nanoseconds disorder{0};

  /// Returns the frames of cameras and scanners.
  std::vector<std::string> sensor_frames() const;
  /// Returns whether the tree of frames joins a frame to the vehicle. One that stands does not.
  bool moves_with_vehicle(const std::string& frame) const;
  /// Returns whether a frame stands: by its name, or because the recording's poses are given in it. What a point cloud
  /// says in such a frame is a map, and no measurement of a scanner.
  bool stands(const std::string& frame) const;
  /// Returns the pose of the vehicle that a topic of tf says: that of the frame which carries the most sensors, or that
  /// of the vehicle by its name; nothing: it says none.
  std::optional<PoseTopic> pose_of_tree(const TreeLinks& links) const;
};

/// Returns whether packets of a drive may be made of a topic's messages.
bool is_imported(const rosbag::BagTopic& topic);

/// Returns the stamp of a message of such a topic; nothing: it has none.
std::optional<UnixTime> stamp_of(const rosbag::BagTopic& topic, const rosbag::BagMessage& message);

/// Reads a recording to its end or its damage. `metres`: those of the local poses that can be used.
Result<BagSurvey> survey_bag(const std::filesystem::path& path, drivers::RosMetres metres);

}  // namespace hueline::apps
