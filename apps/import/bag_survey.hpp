#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
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
  /// Takes the transforms of a tf2_msgs/TFMessage. `is_static`: of /tf_static. Returns false if it is broken.
  bool take(drivers::RosReader message, bool is_static);
  /// Returns the place of frame `of` in frame `in`, or nothing if the tree does not join them.
  std::optional<Eigen::Isometry3d> place(const std::string& of, const std::string& in) const;
  bool has(const std::string& frame) const;
  /// Returns the frames whose names end with `ending`.
  std::set<std::string> ending_with(const std::string& ending) const;

 private:
  struct Parent {
    std::string frame;
    Eigen::Isometry3d T_parent_child;
    bool is_static = false, moves = false;
  };
  std::vector<std::pair<std::string, Eigen::Isometry3d>> to_root(const std::string& frame) const;
  std::map<std::string, Parent> parents_;  // by child
};

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
};

/// Returns whether packets of a drive may be made of a topic's messages.
bool is_imported(const rosbag::BagTopic& topic);

/// Returns the stamp of a message of such a topic; nothing: it has none.
std::optional<UnixTime> stamp_of(const rosbag::BagTopic& topic, const rosbag::BagMessage& message);

/// Reads a recording to its end or its damage.
Result<BagSurvey> survey_bag(const std::filesystem::path& path);

}  // namespace hueline::apps
