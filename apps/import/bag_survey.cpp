#include "apps/import/bag_survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <tuple>
#include <utility>

#include "apps/import/image_message.hpp"
#include "core/calendar.hpp"
#include "core/printable.hpp"
#include "drivers/ros/ros_datagrams.hpp"

namespace hueline::apps {
namespace {

using drivers::RosReader;
using drivers::without_slash;

/// Returns whether a frame is that of a vehicle's body, by REP 105 and habit; the vehicle's name may stand before it.
bool is_body(std::string_view frame) {
  constexpr std::array<std::string_view, 3> kBodies{"base_link", "base_footprint", "ego_vehicle"};
  return std::ranges::find(kBodies, frame.substr(frame.rfind('/') + 1)) != kBodies.end();
}

bool is_of_static_tree(const rosbag::BagTopic& topic) { return topic.name.ends_with("tf_static"); }

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
    if (out.fields.empty() && topic.type.find("PointCloud") != std::string::npos)
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
  explicit Surveyor(drivers::RosMetres metres) : metres_(metres) {}
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
    if (drivers::carries_transforms(topic.type)) return take_tree(topic, message.received, in);
    if (drivers::pose_rank(topic.type) != drivers::RosPoseRank::None) return take_pose(topic, message.received, in);
    if (drivers::have_header(topic.type))
      out.frames.emplace(topic.name, without_slash(RosReader(in).take_header().frame));
  }

  /// Call it after the last message.
  void finish() {
    for (auto& [name, pose] : out.poses) {
      if (pose.usable == 0 && pose.of_other_metres > 0)
        pose.why = metres_ == drivers::RosMetres::AboutPlace
                       ? fmt::format(
                             "its positions are more than {:.0f} km from their origin, as coordinates of a map "
                             "(UTM) are: name the map with --map",
                             drivers::kFarthest_m / 1000)
                       : fmt::format(
                             "its positions are less than {:.0f} km from zero, so they are not coordinates of "
                             "a map: name their origin with --origin",
                             drivers::kNearestOfMap_m / 1000);
      if (pose.first_place && are_degrees(*pose.first_place)) {
        pose.why = "its positions are degrees, as those of a sensor_msgs/NavSatFix here, and not metres";
        pose.usable = 0;
      }
      // Odometry is the way of a vehicle whatever it calls its frames.
      if (pose.type.starts_with("geometry_msgs/") && out.moves_with_vehicle(pose.world)) {
        pose.why = fmt::format("its poses are given in the frame {}, which moves with the vehicle", pose.world);
        pose.usable = pose.oriented = 0;
      }
      if (!turning_.contains(name)) pose.oriented = 0;
    }
    for (auto& [name, links] : links_)
      if (auto pose = out.pose_of_tree(links)) out.poses.emplace(name, std::move(*pose));
  }

  BagSurvey out;

 private:
  void take_tree(const rosbag::BagTopic& topic, UnixTime received, const RosReader& in) {
    const auto transforms = drivers::take_transforms(in);
    if (!transforms) return;
    out.tree.take(*transforms, is_of_static_tree(topic));
    if (is_of_static_tree(topic)) return;
    for (const auto& one : *transforms) {
      auto& links = links_[topic.name];
      if (links.size() == FrameTree::kMostFrames && !links.contains(one.child)) continue;
      PoseTopic& link = links.try_emplace(one.child, PoseTopic{topic.type, one.child}).first->second;
      // Programs send a transform again while there is no newer one.
      const bool is_repeated = link.end && count_ns(one.time) != 0 && one.time <= *link.end;
      link.usable += is_repeated ? 0 : 1;
      take_time(link, one.time, one.time, received);
    }
  }
  /// Takes the time of a message that can be used. `stamp`: its header's; `said`: its own time.
  static void take_time(PoseTopic& pose, UnixTime said, UnixTime stamp, UnixTime received) {
    const UnixTime time = count_ns(said) == 0 ? received : said;
    if (time < to_unix(GpsTime())) ++pose.before_gps;
    pose.begin = std::min(pose.begin.value_or(time), time);
    pose.end = std::max(pose.end.value_or(time), time);
    // A receiver's time may be off by seconds until it has a fix: the nearest one tells the clocks apart.
    const nanoseconds delay = received - time;
    if (!pose.delay || std::chrono::abs(delay) < std::chrono::abs(*pose.delay)) pose.delay = delay;
    pose.shortest_delay = std::min(pose.shortest_delay.value_or(delay), delay);
    if (count_ns(stamp) != 0) (stamp < to_unix(GpsTime()) ? pose.pace_before_gps : pose.pace).take(stamp, received);
  }
  void take_camera(const rosbag::BagTopic& topic, UnixTime received, const RosReader& in) {
    CameraTopic& camera = out.cameras[topic.name];
    ++camera.images;
    RosReader head = in;
    const UnixTime stamp = take_image_header(topic.type, head).stamp;
    if (count_ns(stamp) == 0)
      ++camera.unstamped;
    else
      camera.delay = std::min(camera.delay.value_or(received - stamp), received - stamp);
    if (camera.used_bits < 16) camera.used_bits = std::max(camera.used_bits, used_bits(topic.type, in));
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
      camera.orientation = image->orientation;
      camera.is_compressed = topic.type.ends_with("/CompressedImage");
    }
  }
  void take_pose(const rosbag::BagTopic& topic, UnixTime received, RosReader in) {
    const auto [known, is_new] = out.poses.try_emplace(topic.name, PoseTopic{topic.type, {}});
    PoseTopic& pose = known->second;
    if (pose.type != topic.type) return;  // ROS does not allow a second type under one name
    const auto said = drivers::pose_time(topic.type, in, metres_);
    const bool is_local = drivers::pose_rank(topic.type) == drivers::RosPoseRank::Local;
    const auto local = is_local ? drivers::take_local_pose(topic.type, in, drivers::RosMetres::Any) : std::nullopt;
    if (said || local) take_time(pose, said ? *said : local->time, RosReader(in).take_header().stamp, received);
    if (said) ++pose.usable;
    if (said && drivers::states_accuracy(topic.type, in, metres_)) ++pose.with_sigma;
    if (local) {
      take_local(topic.name, *local, said.has_value(), pose);
    } else if (is_local) {
      if (topic.type == "geometry_msgs/PoseArray") ++pose.of_several;
    } else if (is_new) {
      pose.frame = without_slash(RosReader(in).take_header().frame);
    }
    if (topic.type == "sensor_msgs/NavSatFix" && !fix_)
      if (const auto position = drivers::take_position(topic.type, in)) fix_ = position->place;
  }

  /// `fits`: its metres are those of the survey.
  void take_local(const std::string& topic, const drivers::RosLocalPose& local, bool fits, PoseTopic& pose) {
    if (++pose.oriented == 1) {
      pose.world = local.frame;
      pose.frame = local.body;
    }
    // Programs that know no orientation say that there is no rotation at all.
    if (local.q_enu_flu.angularDistance(Eigen::Quaterniond::Identity()) > 0) turning_.insert(topic);
    if (!fits) {
      pose.of_other_metres += local.enu.allFinite() ? 1 : 0;
      return;
    }
    pose.farthest_m = std::max(pose.farthest_m, local.enu.norm());
    if (!pose.first_place) pose.first_place = local.enu;
  }

  /// Returns whether a local position is what the recording's NavSatFix says, as in the poses of Septentrio's driver
  /// for ROS: x and y are longitude and latitude.
  bool are_degrees(const Eigen::Vector3d& position) const {
    constexpr double kDegree = std::numbers::pi / 180, kNear = 0.05;
    return fix_ && std::abs(position.x() - fix_->longitude / kDegree) < kNear &&
           std::abs(position.y() - fix_->latitude / kDegree) < kNear;
  }

  drivers::RosMetres metres_;
  std::optional<Geodetic> fix_;
  std::map<std::string, CloudSurvey> clouds_;
  std::map<std::string, TreeLinks> links_;  // by topic
  std::set<std::string> turning_;           // topics of local poses with a rotation
  UnixTime newest_{UnixTime::min()};
};

}  // namespace

void FrameTree::take(const std::vector<drivers::RosTransform>& transforms, bool is_static) {
  constexpr double kSame = 1e-6;
  for (const auto& [time, parent, child, T] : transforms) {
    if (parents_.size() == kMostFrames) continue;
    const auto [known, is_new] = parents_.try_emplace(child, Parent{parent, T, is_static});
    if (is_new || (known->second.is_static && !is_static)) continue;
    if (is_static)
      known->second = {parent, T, true};
    else
      known->second.moves |= known->second.frame != parent || !known->second.T_parent_child.isApprox(T, kSame);
  }
}

drivers::RosTransformPath FrameTree::path_up(const std::string& frame) const {
  drivers::RosTransformPath out;
  for (auto found = parents_.find(frame); found != parents_.end() && out.steps.size() < kDeepest;
       found = parents_.find(found->second.frame)) {
    const Parent& up = found->second;
    out.steps.push_back({found->first, up.frame, up.moves ? std::nullopt : std::optional(up.T_parent_child)});
  }
  return out;
}

std::vector<std::pair<std::string, Eigen::Isometry3d>> FrameTree::to_root(const std::string& frame) const {
  std::vector<std::pair<std::string, Eigen::Isometry3d>> out{{frame, Eigen::Isometry3d::Identity()}};
  for (auto found = parents_.find(frame); found != parents_.end() && !found->second.moves && out.size() < kDeepest;
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

std::vector<std::string> BagSurvey::sensor_frames() const {
  std::vector<std::string> out;
  for (const auto& [name, one] : cameras) out.push_back(one.frame);
  for (const auto& [name, one] : clouds) out.push_back(one.frame);
  for (const auto& [name, frame] : frames) out.push_back(frame);
  std::erase(out, std::string());
  return out;
}

bool BagSurvey::moves_with_vehicle(const std::string& frame) const {
  if (is_body(frame)) return true;
  if (frame.empty() || is_standing(frame)) return false;
  return std::ranges::any_of(sensor_frames(), [&](const std::string& sensor) {
    return sensor != frame && !is_standing(sensor) && tree.place(sensor, frame);
  });
}

bool BagSurvey::stands(const std::string& frame) const {
  if (is_standing(frame)) return true;
  if (frame.empty() || moves_with_vehicle(frame)) return false;
  return std::ranges::any_of(poses, [&](const auto& one) {
    const PoseTopic& pose = one.second;
    const auto is_above = [&](const auto& step) { return step.parent == frame; };
    return (pose.type == "nav_msgs/Odometry" && pose.world == frame && pose.frame != frame) ||
           std::ranges::any_of(pose.path.steps, is_above);
  });
}

std::optional<PoseTopic> BagSurvey::pose_of_tree(const TreeLinks& links) const {
  const auto sensors = sensor_frames();
  std::optional<PoseTopic> best;
  std::tuple<std::ptrdiff_t, bool, std::uint64_t> most;
  for (const auto& [child, link] : links) {
    drivers::RosTransformPath path = tree.path_up(child);
    if (path.steps.empty()) continue;
    // A vehicle may stand all the time.
    if (is_standing(path.steps.front().parent)) path.steps.front().fixed.reset();
    if (path.steps.front().fixed) continue;
    const std::string& world = path.steps.back().parent;
    const auto carried = std::ranges::count_if(
        sensors, [&, &child = child](const std::string& one) { return tree.place(one, child).has_value(); });
    // A wheel moves, too, and so does everything on a vehicle that nobody has placed in the world.
    if (moves_with_vehicle(world) || std::ranges::find(sensors, world) != sensors.end()) continue;
    const bool is_vehicle = is_body(child) || is_standing(path.steps.front().parent);
    if (carried == 0 && !is_vehicle) continue;
    const std::tuple worth(carried, is_body(child), link.usable);
    if (best && worth <= most) continue;
    most = worth;
    best = link;
    best->world = world;
    best->path = std::move(path);
  }
  return best;
}

bool is_standing(std::string_view frame) {
  constexpr std::array<std::string_view, 8> kStanding{"map",         "odom",   "world", "earth",
                                                      "camera_init", "global", "utm",   "enu"};
  const std::string_view name = frame.substr(frame.rfind('/') + 1);
  return std::ranges::find(kStanding, name) != kStanding.end() || name.ends_with("_map") || name.ends_with("_odom");
}

bool is_imported(const rosbag::BagTopic& topic) {
  return topic.trouble.empty() && !is_of_static_tree(topic) &&
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
  if (drivers::carries_transforms(topic.type)) in.take_count(1);  // that of the first one
  const UnixTime stamp = carries_image(topic.type) ? take_image_header(topic.type, in).stamp : in.take_header().stamp;
  return in.ok() && count_ns(stamp) != 0 ? std::optional(stamp) : std::nullopt;
}

Result<BagSurvey> survey_bag(const std::filesystem::path& path, drivers::RosMetres metres) {
  auto bag = rosbag::open_bag(path);
  if (!bag.ok()) return bag.error();
  Surveyor surveyor(metres);
  for (;;) {
    const auto message = (*bag)->next();
    if (message.ok()) {
      const rosbag::BagTopic& topic = (*bag)->topics()[message->topic];
      if (topic.trouble.empty()) surveyor.take(topic, *message);
    } else if (message.error().code != ErrorCode::Malformed) {
      surveyor.finish();
      return std::move(surveyor.out);
    }
  }
}

}  // namespace hueline::apps
