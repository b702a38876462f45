#include "apps/import/transcriber.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/import/image_message.hpp"

namespace hueline::apps {
namespace {

constexpr nanoseconds kPatience = std::chrono::seconds(5);
constexpr std::size_t kMostBytes = std::size_t{1} << 30;

drivers::RosReader reader(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
  return {message.data.bytes(), topic.encoding};
}

}  // namespace

Status OrderedJournal::add(SensorId sensor, UnixTime received, Buffer bytes) {
  waiting_bytes_ += bytes.size();
  const HostTime time = host_time_ns(count_ns(received));
  newest_ = std::max(newest_, time);
  waiting_.push({{time, next_++}, {sensor, PacketKind::Wire, false, 0, time, std::move(bytes)}});
  while (!waiting_.empty() && (newest_ - waiting_.top().key.first > kPatience || waiting_bytes_ > kMostBytes))
    if (Status done = write(); !done.ok()) return done;
  return {};
}

Status OrderedJournal::close() {
  while (!waiting_.empty())
    if (Status done = write(); !done.ok()) return done;
  return writer_.close();
}

Status OrderedJournal::write() {
  Packet packet = waiting_.top().packet;
  waiting_.pop();
  waiting_bytes_ -= packet.bytes.size();
  packet.sequence = written_++;
  return writer_.append(packet, packet.received.time_since_epoch());
}

Transcriber::Transcriber(const std::vector<ImportedSensor>& sensors, const PoseChoice& pose, drivers::RosWorld world,
                         OrderedJournal& journal)
    : sensors_(sensors), from_(pose), pose_(pose.rank, std::move(world), pose.shift, pose.path), journal_(journal) {
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const auto id = static_cast<SensorId>(i + 1);
    if (sensors[i].kind == ImportedSensor::Kind::Pose)
      pos_ = id;
    else
      ids_[sensors[i].topic] = id;
    descriptions_[id] = sensors[i].description;
  }
}

Status Transcriber::take(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
  if (is_pose(topic)) return take_pose(topic, message);
  const auto id = ids_.find(topic.name);
  if (id == ids_.end()) return {};
  switch (sensors_[id->second - 1u].kind) {
    case ImportedSensor::Kind::Camera:
      return take_image(id->second, topic, message);
    case ImportedSensor::Kind::Cloud:
      return take_cloud(id->second, topic, message);
    case ImportedSensor::Kind::Packets:
      return take_datagrams(id->second, topic, message);
    case ImportedSensor::Kind::Pose:
      break;
  }
  return {};
}

Status Transcriber::finish() {
  pose_.finish(logs_);
  return write_logs();
}

bool Transcriber::is_pose(const rosbag::BagTopic& topic) const {
  const bool is_of_rank = drivers::pose_rank(topic.type) == from_.rank || topic.name == from_.oriented_by;
  return pos_ != kSystemSensor && is_of_rank && std::ranges::find(from_.topics, topic.name) != from_.topics.end();
}

/// Returns when the recorder took a message, by the clock of the poses.
UnixTime Transcriber::recorded(const rosbag::BagMessage& message) const {
  return message.received - from_.recorder_ahead();
}

std::string Transcriber::dropped_of(const rosbag::BagTopic& topic) const {
  const auto found = pose_.dropped().find(topic.type);
  if (!is_pose(topic) || found == pose_.dropped().end()) return {};
  const drivers::RosPose::Dropped& dropped = found->second;
  std::string out;
  if (dropped.unplaced > 0)
    out += fmt::format("; {} orientations are not between two positions that are at most {} s apart", dropped.unplaced,
                       drivers::RosPoseJoiner::kLongestSpan / std::chrono::seconds(1));
  if (dropped.outside > 0)
    out += fmt::format("; {} positions are zeros, or too far away to be of this drive", dropped.outside);
  if (dropped.without_fix > 0) out += fmt::format("; {} positions are without a fix", dropped.without_fix);
  if (dropped.alone > 0) out += "; a single message has no velocity";
  if (dropped.of_other_clock > 0)
    out += fmt::format("; {} messages have stamps of another clock, {} 1980", dropped.of_other_clock,
                       from_.shift == nanoseconds(0) ? "before" : "after");
  if (dropped.together > 0)
    out += fmt::format(
        "; {} messages are less than 0.5 ms behind another, as those that were stamped when they were "
        "taken from a queue: the first of them is used",
        dropped.together);
  if (dropped.repeated > 0) out += fmt::format("; {} messages repeat the one before", dropped.repeated);
  if (dropped.late > 0) out += fmt::format("; {} messages are out of their order in time", dropped.late);
  return out;
}

Status Transcriber::take_pose(const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
  if (!pose_.take(topic.type, reader(topic, message), message.received, logs_)) ++unread[topic.name];
  return write_logs();
}

Status Transcriber::write_logs() {
  poses_ += logs_.size();
  for (const auto& one : logs_)
    if (Status done = journal_.add(pos_, one.received, one.bytes); !done.ok()) return done;
  logs_.clear();
  return {};
}

/// A cloud is recorded as it is, at the time of its last point. A broken one is recorded too, at the recorder's time.
Status Transcriber::take_cloud(SensorId id, const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
  const ImportedSensor& sensor = sensors_[id - 1u];
  UnixTime received = recorded(message);
  if (const auto cloud = drivers::take_cloud(topic.type, reader(topic, message)); !cloud.ok())
    ++unread[topic.name];
  else if (count_ns(cloud->header.stamp) != 0)
    received = cloud->header.stamp + drivers::RosCloudDecoder::end_of(*cloud, sensor.times) + sensor.stamp_shift;
  return journal_.add(id, received, message.data);
}

Status Transcriber::take_image(SensorId id, const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
  const ImageStamp stamp{images_[id]++, recorded(message), sensors_[id - 1u].stamp_shift,
                         sensors_[id - 1u].raised_bits};
  const auto image = apps::take_image(topic.type, reader(topic, message), stamp);
  if (!image.ok()) return ++unread[topic.name], Status();
  return journal_.add(id, image->header.stamp + kImportedImageLatency, image->packet);
}

Status Transcriber::take_datagrams(SensorId id, const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
  datagrams_.clear();
  if (!drivers::take_datagrams(topic.type, reader(topic, message), datagrams_)) ++unread[topic.name];
  for (const auto& one : datagrams_) {
    const UnixTime received = one.stamp.value_or(recorded(message));
    if (auto& text = descriptions_[id]; !text.empty())
      if (Status done = journal_.add(id, received, std::exchange(text, {})); !done.ok()) return done;
    if (Status done = journal_.add(id, received, Buffer::copy_of(one.bytes)); !done.ok()) return done;
  }
  return {};
}

}  // namespace hueline::apps
