#include "apps/import/import_rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <string_view>
#include <utility>

#include "apps/import/rectified_place.hpp"
#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "core/exif_orientation.hpp"
#include "core/json_text.hpp"
#include "core/printable.hpp"

namespace hueline::apps {
namespace {

/// One sigma that an image's header.stamp gets: drivers take the time when they had the image, some ms after the
/// exposure.
constexpr int kImageStampSigma_us = 10'000;

/// Six numbers as the mounting of a rig file. `T_a_b` maps coordinates of b into a.
std::string mounting(const Eigen::Isometry3d& T_a_b) {
  const Eigen::Quaterniond q(T_a_b.linear());
  const Eigen::Vector3d& t = T_a_b.translation();
  return fmt::format("{{position_m: [{:.6f}, {:.6f}, {:.6f}], quaternion_wxyz: [{:.9f}, {:.9f}, {:.9f}, {:.9f}]}}",
                     t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z());
}
/// A turn about the vertical axis, deg.
Eigen::Isometry3d turn(double degrees) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()));
}
/// From ROS's vehicle axes (x forward, y left, REP 103) to those of Body (x right, y forward).
Eigen::Isometry3d body_from_ros() { return turn(90); }

const char* word_of(drivers::RosTimeUnit unit) {
  constexpr std::array<const char*, 5> kWords{"auto", "s", "ms", "us", "ns"};
  return kWords[static_cast<std::size_t>(unit)];
}
const char* word_of(drivers::RosTimeZero zero) {
  constexpr std::array<const char*, 4> kWords{"auto", "stamp", "date", "first"};
  return kWords[static_cast<std::size_t>(zero)];
}

/// The keys of a sensor that reads point clouds.
std::string keys_of(const drivers::RosCloudDecoder::Config& config) {
  std::string out = fmt::format("    driver: ros_cloud\n    message: {}\n    encoding: {}\n", word_of(config.message),
                                name(config.encoding));
  if (config.stamp_is_enough)
    out += "    stamp_is_enough: true  # the points have no times of their own\n";
  else
    out += fmt::format("    time_field: '{}'\n    time_unit: {}\n    time_zero: {}\n", config.times.field,
                       word_of(config.times.unit), word_of(config.times.zero));
  if (!config.times.seconds_field.empty())
    out += fmt::format("    time_seconds_field: '{}'\n", config.times.seconds_field);
  return out + fmt::format("    stamp_sigma_us: {}  # NOT KNOWN: {}\n    intensity_full: {}\n",
                           config.stamp_sigma / std::chrono::microseconds(1),
                           config.stamp_is_enough ? "half of the time between two messages"
                                                  : "how far header.stamp is from the moment that it names",
                           number_text(config.intensity_full));
}

}  // namespace

void ImportRig::add_pose() {
  for (const auto& [topic, why] : pose_.not_used) became_[topic] = "not used: " + why;
  if (pose_.rank == drivers::RosPoseRank::None) {
    to_do_.push_back("the recording has no pose that can be used: a replay places no points");
    return;
  }
  for (const std::string& topic : pose_.topics) became_[topic] = "sensor pos";
  if (!pose_.path.steps.empty())
    became_[pose_.topics.front()] +=
        fmt::format(", the pose of {} in {}", pose_.path.steps.front().child, pose_.path.steps.back().parent);
  const bool is_simulated = pose_.shift != nanoseconds(0);
  if (is_simulated)
    to_do_.push_back(
        fmt::format("the stamps of the poses begin {:.3f} s after 1970, so they are those of a simulator. They are "
                    "counted from {}: the dates of the drive are not true, the times within it are",
                    to_seconds(pose_.begin.time_since_epoch()), iso_utc(from_unix(kSimulatorBegin))));
  if (pose_.is_other_pace)
    to_do_.push_back(
        "the recorder's times go on faster or slower than the stamps of the poses, as in a recording that was played "
        "at "
        "another speed, or that a program has written. They are not used; all stamps are taken for those of one clock");
  if (!is_simulated && pose_.is_by_stamp)
    to_do_.push_back(
        "the times of the poses are header.stamp, taken for UTC; how late it is is NOT KNOWN, and no sigma "
        "of the points has it: 10 ms at 10 m/s are 0.1 m");
  if (!pose_.oriented_by.empty())
    to_do_.push_back(
        fmt::format("no sensor_msgs/Imu says an orientation, so that of {} is taken for the one to east, north and up. "
                    "If it counts from the direction at its start, all points are turned: NOT KNOWN",
                    pose_.oriented_by));
  if (!pose_.is_sigma_known)
    to_do_.push_back(
        "the poses state no accuracy that is used (a covariance), so the sigmas of the points are those of a good "
        "receiver, 0.05 m and 0.03 deg: NOT KNOWN to be true");
  if (!pose_.is_height_known)
    to_do_.push_back(
        "GPSFix does not say from where its heights count. They are taken for those above the ellipsoid; if they are "
        "those above the sea, all points are wrong by the undulation of the geoid (48 m in Germany): NOT KNOWN");
  if (constexpr double kTangent_m = 20'000; pose_.farthest_m > kTangent_m)
    to_do_.push_back(fmt::format(
        "the poses are up to {:.0f} km from their origin. They are taken for metres east, north and up in the plane "
        "that touches the ellipsoid at --origin; coordinates of a map (UTM, MGRS) are not that: their heights would be "
        "{:.0f} m wrong there. Name their map with --map",
        pose_.farthest_m / 1000, pose_.farthest_m * pose_.farthest_m / 2 / 6'371'000));
  sensors_.push_back({free_name("pos"), {}, "", ImportedSensor::Kind::Pose});
  sensors_.back().yaml =
      fmt::format("  - name: {}  # {}{}\n    driver: novatel\n    tcp: {{host: 127.0.0.1, port: 3001}}\n",
                  sensors_.back().name, fmt::join(pose_.topics, ", "),
                  is_simulated        ? "; its times are header.stamp of a simulator, counted from 2020-01-01"
                  : pose_.is_by_stamp ? "; its times are header.stamp, NOT KNOWN how late"
                                      : "");
}

void ImportRig::add_scanner(const rosbag::TopicCount& topic, const CaptureDevice& device, const std::string& metadata,
                            Buffer description) {
  const std::string word = device.type->word;
  const std::string name = free_name(rosbag::plain_name(topic.topic.name));
  std::string model = device.name.substr(std::min(word.size() + 1, device.name.size()));
  model = model.substr(0, model.find(','));
  std::string yaml = fmt::format("  - name: {}  # {}\n    driver: {}\n    udp: {{ports: [{}]}}\n", name,
                                 topic.topic.name, word, word == "ouster" ? 7502 : 2368);
  yaml += metadata.empty() ? fmt::format("    model: {}\n", model) : fmt::format("    metadata: {}\n", metadata);
  // ROS's driver for Velodyne turns their axes (x right) to x forward; others keep those of their maker.
  const Eigen::Isometry3d axes = word == "velodyne" ? turn(-90) : Eigen::Isometry3d::Identity();
  const auto found = survey_->frames.find(topic.topic.name);
  const std::string frame = found == survey_->frames.end() ? "" : found->second;
  yaml += scanner_mounting(name, frame, axes);
  if (!frame.empty()) packets_in_[frame] = topic.topic.name;
  sensors_.push_back({name, topic.topic.name, yaml, ImportedSensor::Kind::Packets, std::move(description)});
  became_[topic.topic.name] = fmt::format("sensor {}: {}", name, device.name);
}

/// Returns why the clouds of a topic are not used; empty: they are.
std::string ImportRig::why_not_used(const std::string& topic, const BagSurvey::Cloud& cloud,
                                    const std::vector<std::string>& wanted) const {
  if (!cloud.config) return cloud.why.empty() ? "no message of it has a return" : cloud.why;
  if (!wanted.empty()) return std::ranges::find(wanted, topic) != wanted.end() ? "" : "--clouds does not name it";
  if (survey_->stands(cloud.frame))
    return fmt::format("its frame {} does not move with the vehicle, so it is a map and no measurement", cloud.frame);
  if (const auto packets = packets_in_.find(cloud.frame); packets != packets_in_.end())
    return fmt::format("the packets of {} are in the same frame", packets->second);
  // Of several clouds in one frame, the others are made of one of them.
  const auto worth = [](const BagSurvey::Cloud& one) {
    return std::pair(one.config && !one.config->stamp_is_enough, one.points);
  };
  for (const auto& [other, one] : survey_->clouds)
    if (other != topic && one.config && one.frame == cloud.frame &&
        (worth(one) > worth(cloud) || (worth(one) == worth(cloud) && other < topic)))
      return fmt::format("{} is in the same frame; if they are of two scanners, name both with --clouds", other);
  return {};
}

void ImportRig::add_clouds(const std::vector<std::string>& wanted) {
  for (const auto& [topic, cloud] : survey_->clouds) {
    if (const std::string why = why_not_used(topic, cloud, wanted); !why.empty())
      became_[topic] = "not used: " + why;
    else
      add_cloud(topic, cloud);
  }
}

void ImportRig::add_cloud(const std::string& topic, const BagSurvey::Cloud& cloud) {
  const std::string name = free_name(rosbag::plain_name(topic));
  ImportedSensor sensor{name, topic, fmt::format("  - name: {}  # {}\n", name, topic), ImportedSensor::Kind::Cloud};
  sensor.times = cloud.config->times;
  sensor.stamp_shift = shift_of(name, "points", cloud.delay);
  if (cloud.config->stamp_is_enough)
    to_do_.push_back(fmt::format(
        "{}: its points have no times of their own. All of a message get header.stamp, with a "
        "sigma of {:.0f} ms: see stamp_sigma_us{}",
        name, to_seconds(cloud.config->stamp_sigma) * 1e3,
        cloud.fields.empty() ? ""
                             : fmt::format(". Its fields are {}: if one is a time, give it as time_field in place of "
                                           "stamp_is_enough",
                                           cloud.fields)));
  sensor.yaml += keys_of(*cloud.config) + scanner_mounting(name, cloud.frame, Eigen::Isometry3d::Identity());
  became_[topic] = fmt::format("sensor {}: {}", name, in_words(cloud.config->times));
  sensors_.push_back(std::move(sensor));
}

/// Returns what is to be added to the stamps of a sensor, so that they are on the clock of the poses: 0 if they are.
nanoseconds ImportRig::shift_of(const std::string& name, const std::string& what, std::optional<nanoseconds> delay) {
  if (pose_.is_other_pace) return nanoseconds(0);  // the recorder's times tell nothing
  const bool is_pose_apart = pose_.recorder_ahead() != nanoseconds(0);
  const nanoseconds apart = delay.value_or(nanoseconds(0)) - pose_.recorder_ahead();
  if (!delay || std::chrono::abs(apart) <= kSameClock) return nanoseconds(0);
  to_do_.push_back(
      fmt::format("{}: its stamps are {:.3f} s from {}, so they are of another clock. The shortest "
                  "of these delays is taken for the difference of the clocks: the {} are late by the part of it "
                  "that the way to the recorder took",
                  name, to_seconds(apart), is_pose_apart ? "those of the poses" : "the recorder's times", what));
  return apart;
}

Status ImportRig::add_cameras(const std::vector<std::string>& wanted, std::chrono::seconds offset) {
  auto cameras = survey_->cameras;
  std::map<std::string, ImportedLens> lenses;
  for (auto& [topic, camera] : cameras) {
    const FoundFacts found = find_facts(survey_->facts, topic, camera.frame, cameras.size() == 1);
    const CameraFacts* facts = found.topic.empty() ? nullptr : &survey_->facts.at(found.topic);
    ImportedLens& lens = lenses[topic] = lens_of(facts, is_rectified(topic), camera.width, camera.height);
    lens.facts = found.topic;
    if (!lens.doubt.empty())
      if (const auto known = rectified_place(*facts, survey_->facts, [&](const std::string& of, const std::string& in) {
            return survey_->tree.place(of, in);
          })) {
        lens.T_frame_lens = known->T_frame_lens;
        lens.remark += (lens.remark.empty() ? "" : "; ") + known->how;
        lens.doubt.clear();
      }
    if (!facts && !survey_->facts.empty())
      lens.why = fmt::format("no CameraInfo is of the frame \"{}\" of its images", camera.frame);
    if (facts && !found.is_of_frame && lens.why.empty())
      lens.why = fmt::format("{} is of the frame {}, the images of {}", found.topic, facts->frame, camera.frame);
    camera.has_lens = lens.why.empty();
  }
  const auto chosen = choose_cameras(cameras, wanted);
  if (!chosen.ok()) return chosen.error();
  for (const auto& [topic, why] : chosen->not_used) became_[topic] = "not used: " + why;
  for (const std::string& topic : chosen->topics) add_camera(topic, cameras.at(topic), lenses.at(topic), offset);
  for (const auto& [topic, facts] : survey_->facts)
    became_.try_emplace(topic, "not used: " + (facts.why.empty() ? "no images of its camera are used" : facts.why));
  if (chosen->topics.empty())
    to_do_.push_back(cameras.empty() ? "the recording has no images: a replay colours no points"
                                     : "no images can be used, see the table: a replay colours no points");
  return {};
}

void ImportRig::add_camera(const std::string& topic, const CameraTopic& camera, const ImportedLens& lens,
                           std::chrono::seconds offset) {
  const std::string name = free_name(rosbag::plain_name(topic));
  ImportedSensor sensor{
      name, topic,
      fmt::format("  - name: {0}  # {1}\n    driver: v4l2\n    device: /dev/video0\n    width: {2}\n    height: {3}\n"
                  "    format: {4}\n    event_input: 0\n    counter_offset_s: {5}  # header.stamp is {7}\n"
                  "    stamp_event: exposure_start\n    stamp_sigma_us: {6}  # NOT KNOWN: how far header.stamp is from "
                  "that\n"
                  "    latency_min_ms: 0\n    latency_max_ms: 200\n",
                  name, topic, camera.width, camera.height, camera.format, offset.count(), kImageStampSigma_us,
                  pose_.shift == nanoseconds(0) ? "UTC since 1970" : "a simulator's, counted from 2020-01-01"),
      ImportedSensor::Kind::Camera};
  sensor.stamp_shift = shift_of(name, "images", camera.delay);
  sensor.raised_bits = camera.raised_bits();
  became_[topic] = fmt::format("sensor {}: {} x {}, {}", name, camera.width, camera.height, camera.format);
  if (sensor.raised_bits > 0)
    became_[topic] += fmt::format("; its values use {} of 16 bits, so they are taken {} times as large",
                                  16 - sensor.raised_bits, 1U << sensor.raised_bits);
  if (camera.unstamped > 0)
    became_[topic] += fmt::format("; {} without a stamp get the recorder's time", camera.unstamped);
  if (camera.orientation != 1)
    to_do_.push_back(fmt::format(
        "{}: its images are to be shown {} by their EXIF data. They are taken as stored, {} x {} px: lens and "
        "T_head_lens are to be those of the stored image",
        name, orientation_words(camera.orientation), camera.width, camera.height));
  if (!lens.doubt.empty()) to_do_.push_back(fmt::format("{}: {}", name, lens.doubt));
  if (!lens.why.empty()) tell_not_known(fmt::format("the lens of {}: {}", name, lens.why));
  const bool has_facts = !lens.facts.empty() && survey_->facts.at(lens.facts).why.empty();
  if (has_facts && !became_.try_emplace(lens.facts, "the lens of " + name).second)
    became_[lens.facts] += " and " + name;
  lenses_ += lens_text(name, camera.frame, lens);
  sensors_.push_back(std::move(sensor));
}

std::string ImportRig::text() const {
  std::string out =
      "# Made of a recording of ROS. Check what is marked as NOT KNOWN, then: hueline replay FOLDER --rig "
      "FOLDER/rig.yaml --out ...\nrig: imported\nsensors:\n";
  for (const ImportedSensor& one : sensors_) out += one.yaml;
  if (!lenses_.empty())
    out += fmt::format(
        "head:  # its axes are those of ROS's vehicle frame\n  T_body_head: {}\n  panorama: {{width: 8000, height: "
        "4000, stitching_radius_m: 20}}\n  lenses:\n{}",
        mounting(body_from_ros()), lenses_);
  out += "colouring: {method: lens}\n";
  if (!not_known_.empty()) out += "not_known:  # remove a line when its value is entered\n";
  for (const std::string& one : not_known_) out += fmt::format("  - {}\n", json_text(printable(one)));
  return out;
}

/// Tells the user what to enter, now and whenever a drive is made with the guess that stands for it.
void ImportRig::tell_not_known(std::string what) {
  not_known_.push_back(what);
  to_do_.push_back(std::move(what));
}

std::string ImportRig::lens_text(const std::string& name, const std::string& frame, const ImportedLens& imported) {
  const fusion::CameraIntrinsics& lens = imported.lens;
  const bool is_fisheye = lens.model == fusion::LensModel::KannalaBrandt;
  auto place = place_of(frame);
  if (place) *place = *place * imported.T_frame_lens;
  // Without a tree: looking forward.
  Eigen::Isometry3d forward = Eigen::Isometry3d::Identity();
  forward.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  std::string remark = imported.why.empty() ? imported.remark : "NOT KNOWN: " + imported.why;
  if (!remark.empty()) remark = "  # " + printable(remark);
  std::string distortion =
      fmt::format("[{}]", fmt::join(lens.distortion.begin(), lens.distortion.begin() + (is_fisheye ? 4 : 5), ", "));
  // A lens that was fitted to an image holds as far as the image reaches.
  if (lens.max_angle != fusion::CameraIntrinsics().max_angle)
    distortion += fmt::format("\n      max_angle_deg: {:.3f}", lens.max_angle / kRadPerDeg);
  return fmt::format(
      "    - name: {0}\n      camera: {0}\n      offset_px: [0, 0]\n      width: {1}\n      height: {2}\n      "
      "model: {3}{4}\n"
      "      focal_px: [{5:.6f}, {6:.6f}]\n      principal_point_px: [{7:.6f}, {8:.6f}]\n      distortion: {9}\n"
      "      T_head_lens: {10}{11}\n",
      name, lens.width, lens.height, is_fisheye ? "kannala_brandt" : "brown", remark, lens.focal_px.x(),
      lens.focal_px.y(), lens.principal_point_px.x(), lens.principal_point_px.y(), distortion,
      mounting(place.value_or(forward)), where_from("T_head_lens", name, frame, place.has_value()));
}

/// Returns the frame that stands for the vehicle's body: that of the pose, or base_link, which may have the vehicle's
/// name before it.
std::string ImportRig::base() const {
  const std::string usual = "base_link";
  if (survey_->tree.has(pose_.frame)) return pose_.frame;
  const auto named = survey_->tree.ending_with("/" + usual);
  return !survey_->tree.has(usual) && named.size() == 1 ? *named.begin() : usual;
}

std::optional<Eigen::Isometry3d> ImportRig::place_of(const std::string& frame) const {
  return frame.empty() ? std::nullopt : survey_->tree.place(frame, base());
}

/// Returns the remark behind a mounting, and tells what is to be entered if it is not known.
std::string ImportRig::where_from(const std::string& key, const std::string& sensor, const std::string& frame,
                                  bool is_known) {
  if (is_known) {
    ++mounted_;
    return fmt::format("  # {} in {}, by the recording's tree of frames", frame, base());
  }
  std::string why = fmt::format("the tree of frames does not join its frame {} with {}", frame, base());
  if (frame.empty())
    why = "its messages name no frame";
  else if (!survey_->tree.has(frame))
    why = fmt::format("the tree of frames does not have its frame {}", frame);
  else if (!survey_->tree.has(base()))
    why = fmt::format("the tree of frames does not have the frame {} of the vehicle", base());
  tell_not_known(fmt::format("{} of {} is not known: {}", key, sensor, why));
  return "  # NOT KNOWN: " + why;
}

std::string ImportRig::scanner_mounting(const std::string& name, const std::string& frame,
                                        const Eigen::Isometry3d& axes) {
  const auto place = place_of(frame);
  return fmt::format("    T_body_scanner: {}{}\n",
                     // Without a tree: looking forward, as the clouds of ROS do.
                     mounting(body_from_ros() * place.value_or(Eigen::Isometry3d::Identity()) * axes),
                     where_from("T_body_scanner", name, frame, place.has_value()));
}

std::string ImportRig::free_name(std::string name) const {
  const auto is_taken = [&] { return std::ranges::find(sensors_, name, &ImportedSensor::name) != sensors_.end(); };
  while (is_taken() || name == "hueline") name += "_";
  return name;
}

}  // namespace hueline::apps
