#include "apps/import/bag_survey.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/import/image_message.hpp"
#include "core/calendar.hpp"
#include "core/printable.hpp"
#include "drivers/ros/ros_datagrams.hpp"

namespace hueline::apps {
namespace {

using drivers::RosReader;

std::string without_slash(std::string frame) {
  if (frame.starts_with('/')) frame.erase(0, 1);  // ROS 1's first tf wrote one
  return frame;
}

/// Sees the first clouds of one topic: enough to know how far they are apart.
class CloudSurvey {
 public:
  void take(const rosbag::BagTopic& topic, const rosbag::BagMessage& message, BagSurvey::Cloud& out) {
    constexpr int kMost = 50;
    if (seen_ == kMost) return;
    const auto cloud = drivers::take_cloud(topic.type, {message.data.bytes(), topic.encoding});
    if (!cloud.ok()) {
      out.why = cloud.error().message;
      return;
    }
    ++seen_;
    const UnixTime stamp = cloud->header.stamp;
    if (last_ && stamp > *last_) period_ = std::min(period_.value_or(stamp - *last_), stamp - *last_);
    last_ = stamp;
    out.frame = without_slash(cloud->header.frame);
    out.points = std::max(out.points, cloud->size());
    if (out.fields.empty() && topic.type == "sensor_msgs/PointCloud2")
      for (const auto& field : cloud->fields) out.fields += (out.fields.empty() ? "" : ", ") + printable(field.name);
    // The second cloud says how long a turn is.
    if ((!out.config || seen_ == 2) && drivers::recognise_times(*cloud, {}))
      out.config = drivers::RosCloudDecoder::suited(topic.type, topic.encoding, *cloud,
                                                    period_.value_or(std::chrono::milliseconds(100)));
    if (!out.config || count_ns(stamp) == 0) return;
    const nanoseconds delay = message.received - (stamp + drivers::RosCloudDecoder::end_of(*cloud, out.config->times));
    out.delay = std::min(out.delay.value_or(delay), delay);
  }

 private:
  int seen_ = 0;
  std::optional<UnixTime> last_;
  std::optional<nanoseconds> period_;
};

/// Sees the messages one after another.
class Surveyor {
 public:
  void take(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
    const RosReader in(message.data.bytes(), topic.encoding);
    if (is_imported(topic)) {
      newest_ = std::max(newest_, message.received);
      out.disorder = std::max(out.disorder, newest_ - message.received);
    }
    if (drivers::carries_cloud(topic.type)) return clouds_[topic.name].take(topic, message, out.clouds[topic.name]);
    if (carries_image(topic.type)) return take_camera(topic, message.received, in);
    if (topic.type == "sensor_msgs/CameraInfo") {
      // The first that can be used stays, or the last that says why it cannot.
      if (CameraFacts& known = out.facts[topic.name]; known.K[0] <= 0 || !known.why.empty())
        known = take_camera_info(in);
      return;
    }
    const bool is_tree = topic.type == "tf2_msgs/TFMessage" || topic.type == "tf/tfMessage";
    if (is_tree) {
      out.tree.take(in, topic.name.ends_with("tf_static"));
      return;
    }
    if (drivers::pose_rank(topic.type) != drivers::RosPoseRank::None) return take_pose(topic, message.received, in);
    if (drivers::have_header(topic.type))
      out.frames.emplace(topic.name, without_slash(RosReader(in).take_header().frame));
  }

  BagSurvey out;

 private:
  void take_camera(const rosbag::BagTopic& topic, UnixTime received, const RosReader& in) {
    CameraTopic& camera = out.cameras[topic.name];
    ++camera.images;
    RosReader head = in;
    const UnixTime stamp = take_image_header(topic.type, head).stamp;
    if (count_ns(stamp) == 0)
      ++camera.unstamped;
    else
      camera.delay = std::min(camera.delay.value_or(received - stamp), received - stamp);
    if (camera.width > 0) return;
    const auto image = take_image(topic.type, in, {});
    constexpr std::uint32_t kSmallest = 8;  // px, of a lens
    if (!image.ok()) {
      camera.why = image.error().message;
    } else if (image->width < kSmallest || image->height < kSmallest) {
      camera.why = "its images have fewer than 8 pixels a side";
    } else {
      camera.format = image->format;
      camera.frame = without_slash(image->header.frame);
      camera.width = image->width, camera.height = image->height;
      camera.is_grey = image->is_grey;
      camera.is_compressed = topic.type.ends_with("/CompressedImage");
    }
  }
  void take_pose(const rosbag::BagTopic& topic, UnixTime received, RosReader in) {
    const auto [known, is_new] = out.poses.try_emplace(topic.name, PoseTopic{topic.type, {}});
    PoseTopic& pose = known->second;
    if (pose.type != topic.type) return;  // ROS does not allow a second type under one name
    if (const auto said = drivers::pose_time(topic.type, in)) {
      const UnixTime time = count_ns(*said) == 0 ? received : *said;
      ++pose.usable;
      if (time < to_unix(GpsTime())) ++pose.before_gps;
      if (topic.type == "sensor_msgs/NavSatFix" && drivers::take_position(in)->sigma_enu) ++pose.with_sigma;
      pose.begin = std::min(pose.begin.value_or(time), time);
      // A receiver's time may be off by seconds until it has a fix: the nearest one tells the clocks apart.
      const nanoseconds delay = received - time;
      if (!pose.delay || std::chrono::abs(delay) < std::chrono::abs(*pose.delay)) pose.delay = delay;
      if (const UnixTime stamp = RosReader(in).take_header().stamp; count_ns(stamp) != 0)
        (stamp < to_unix(GpsTime()) ? pose.pace_before_gps : pose.pace).take(stamp, received);
    }
    if (!is_new) return;
    std::string frame = in.take_header().frame;
    if (drivers::pose_rank(topic.type) == drivers::RosPoseRank::Local)
      frame = in.take_string();  // the child of the pose
    pose.frame = without_slash(frame);
  }

  std::map<std::string, CloudSurvey> clouds_;
  UnixTime newest_{UnixTime::min()};
};

}  // namespace

bool FrameTree::take(RosReader in, bool is_static) {
  constexpr std::size_t kMostFrames = 10'000;
  constexpr double kSame = 1e-6;
  const std::uint32_t count = in.take_count(8 * 7);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string parent = without_slash(in.take_header().frame), child = without_slash(in.take_string());
    Eigen::Vector3d t;
    for (double& value : t) value = in.take<double>();
    const auto x = in.take<double>(), y = in.take<double>(), z = in.take<double>(), w = in.take<double>();
    const Eigen::Quaterniond q(w, x, y, z);
    if (!in.ok()) return false;
    if (!t.allFinite() || !(std::abs(q.norm() - 1) < 0.01) || parents_.size() == kMostFrames) continue;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = q.normalized().toRotationMatrix();
    T.translation() = t;
    const auto [known, is_new] = parents_.try_emplace(child, Parent{parent, T, is_static});
    if (is_new || (known->second.is_static && !is_static)) continue;
    if (is_static)
      known->second = {parent, T, true};
    else
      known->second.moves |= known->second.frame != parent || !known->second.T_parent_child.isApprox(T, kSame);
  }
  return true;
}

std::vector<std::pair<std::string, Eigen::Isometry3d>> FrameTree::to_root(const std::string& frame) const {
  std::vector<std::pair<std::string, Eigen::Isometry3d>> out{{frame, Eigen::Isometry3d::Identity()}};
  constexpr std::size_t kDeepestTree = 100;  // a circle ends here
  for (auto found = parents_.find(frame); found != parents_.end() && !found->second.moves && out.size() < kDeepestTree;
       found = parents_.find(found->second.frame))
    out.emplace_back(found->second.frame, found->second.T_parent_child * out.back().second);
  return out;
}

std::optional<Eigen::Isometry3d> FrameTree::place(const std::string& of, const std::string& in) const {
  const auto from = to_root(of), to = to_root(in);
  for (const auto& [frame, T_frame_of] : from)
    for (const auto& [other, T_frame_in] : to)
      if (frame == other) return T_frame_in.inverse() * T_frame_of;
  return {};
}

bool FrameTree::has(const std::string& frame) const {
  return parents_.contains(frame) ||
         std::ranges::any_of(parents_, [&](const auto& one) { return one.second.frame == frame; });
}

std::set<std::string> FrameTree::ending_with(const std::string& ending) const {
  std::set<std::string> out;
  for (const auto& [child, parent] : parents_)
    for (const std::string& frame : {child, parent.frame})
      if (frame.ends_with(ending)) out.insert(frame);
  return out;
}

bool is_imported(const rosbag::BagTopic& topic) {
  return topic.trouble.empty() &&
         (drivers::carries_cloud(topic.type) || carries_image(topic.type) || drivers::carries_datagrams(topic.type) ||
          drivers::pose_rank(topic.type) != drivers::RosPoseRank::None);
}

std::optional<UnixTime> stamp_of(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
  RosReader in(message.data.bytes(), topic.encoding);
  if (drivers::carries_datagrams(topic.type)) {
    std::vector<drivers::RosDatagram> datagrams;
    drivers::take_datagrams(topic.type, in, datagrams);
    return datagrams.empty() ? std::nullopt : datagrams.front().stamp;
  }
  const UnixTime stamp = carries_image(topic.type) ? take_image_header(topic.type, in).stamp : in.take_header().stamp;
  return in.ok() && count_ns(stamp) != 0 ? std::optional(stamp) : std::nullopt;
}

Result<BagSurvey> survey_bag(const std::filesystem::path& path) {
  auto bag = rosbag::open_bag(path);
  if (!bag.ok()) return bag.error();
  Surveyor surveyor;
  for (;;) {
    const auto message = (*bag)->next();
    if (message.ok()) {
      const rosbag::BagTopic& topic = (*bag)->topics()[message->topic];
      if (topic.trouble.empty()) surveyor.take(topic, *message);
    } else if (message.error().code != ErrorCode::Malformed) {
      return std::move(surveyor.out);
    }
  }
}

}  // namespace hueline::apps
