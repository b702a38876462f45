#include "storage/view_writer.hpp"

#include <string>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "storage/descriptor_set.hpp"
#include "storage/image_view.hpp"
#include "storage/view_fields.hpp"
#include "storage_proto/foxglove/CompressedImage.pb.h"
#include "storage_proto/foxglove/FrameTransform.pb.h"
#include "storage_proto/foxglove/LocationFix.pb.h"
#include "storage_proto/foxglove/Log.pb.h"
#include "storage_proto/foxglove/PoseInFrame.pb.h"

namespace hueline::storage {
namespace {

constexpr const char* kEnu = "enu";
constexpr const char* kBody = "body";
constexpr std::size_t kMostBytes = 9'000'000;  // bytes of points in one message

template <class Message>
void stamp(Message& message, GpsTime time) {
  const std::int64_t ns = count_ns(to_unix(time));
  message.mutable_timestamp()->set_seconds(ns / 1'000'000'000);
  message.mutable_timestamp()->set_nanos(static_cast<std::int32_t>(ns % 1'000'000'000));
}
void set(foxglove::Vector3& out, const Eigen::Vector3d& v) { out.set_x(v.x()), out.set_y(v.y()), out.set_z(v.z()); }
void set(foxglove::Quaternion& out, const Eigen::Quaterniond& q) {
  out.set_x(q.x()), out.set_y(q.y()), out.set_z(q.z()), out.set_w(q.w());
}

}  // namespace

std::string ViewWriter::Config::validate() const {
  if (keep_every == 0) return "keep_every must be at least 1";
  if (cloud_interval <= nanoseconds(0)) return "cloud_interval must be above 0";
  if (pose_interval < nanoseconds(0) || image_interval < nanoseconds(0))
    return "pose_interval and image_interval must not be below 0";
  if (image_longest_px < 16 || image_longest_px > 16384) return "image_longest_px must be from 16 to 16384";
  if (jpeg_quality < 1 || jpeg_quality > 100) return "jpeg_quality must be from 1 to 100";
  return {};
}

ViewWriter::ViewWriter(McapWriter mcap, const Geodetic& origin, const Config& config)
    : mcap_(std::move(mcap)), origin_(origin), T_enu_ecef_(ecef_from_enu(origin).inverse()), config_(config) {}

Result<ViewWriter> ViewWriter::create(const std::filesystem::path& path, const Geodetic& origin, const Config& config) {
  if (std::string wrong = config.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  McapWriter::Config mcap;
  mcap.compression = config.compression;
  mcap.if_exists = config.if_exists;
  Result<McapWriter> writer = McapWriter::create(path, mcap);
  if (!writer) return writer.error();
  ViewWriter view(std::move(*writer), origin, config);
  if (Status added = view.add_channels(); !added) return added.error();
  return view;
}

Status ViewWriter::add_channels() {
  McapMetadata metadata{"hueline.origin", {}};
  metadata.values["latitude_deg"] = std::to_string(origin_.latitude * kDegPerRad);
  metadata.values["longitude_deg"] = std::to_string(origin_.longitude * kDegPerRad);
  metadata.values["ellipsoidal_height_m"] = std::to_string(origin_.ellipsoidal_height);
  if (Status done = mcap_.add_metadata(metadata); !done) return done;
  const auto add = [this](Channel channel, const char* topic, const google::protobuf::Descriptor& type,
                          const char* type_name) {
    const auto schema = mcap_.add_schema({0, type_name, "protobuf", descriptor_set(type)});
    if (!schema) return Status(schema.error());
    return mcap_.add_channel({channel, *schema, topic, "protobuf", {}});
  };
  Status done = add(kCloud, "/cloud", *foxglove::PointCloud::descriptor(), "foxglove.PointCloud");
  if (done) done = add(kPose, "/pose", *foxglove::PoseInFrame::descriptor(), "foxglove.PoseInFrame");
  if (done) done = add(kTransform, "/tf", *foxglove::FrameTransform::descriptor(), "foxglove.FrameTransform");
  if (done) done = add(kFix, "/fix", *foxglove::LocationFix::descriptor(), "foxglove.LocationFix");
  if (done) done = add(kLog, "/log", *foxglove::Log::descriptor(), "foxglove.Log");
  if (done) done = add(kHealth, "/health", *foxglove::Log::descriptor(), "foxglove.Log");
  if (!done) return done;
  const auto schema = mcap_.add_schema(
      {0, "foxglove.CompressedImage", "protobuf", descriptor_set(*foxglove::CompressedImage::descriptor())});
  if (!schema) return schema.error();
  image_schema_ = *schema;
  return {};
}

Status ViewWriter::write(std::uint16_t channel, GpsTime time, const google::protobuf::Message& message) {
  const std::string bytes = message.SerializeAsString();
  const auto log_time = static_cast<std::uint64_t>(count_ns(to_unix(time)));
  return mcap_.write({channel, sequences_[channel]++, log_time, log_time}, as_bytes(bytes));
}

Status ViewWriter::append(const CloudBlock& block) {
  for (const ColouredPoint& p : block.points) {
    if (points_seen_++ % config_.keep_every != 0) continue;
    // A block of an older time, from another scanner, does not close the message. Only points of a later time do.
    if (!points_.empty() && (p.time - cloud_start_ >= config_.cloud_interval || points_.size() >= kMostBytes))
      if (Status written = write_cloud(); !written) return written;
    if (points_.empty()) cloud_start_ = p.time;
    pack_view<kPointFields>(p, points_);
  }
  return {};
}

Status ViewWriter::write_cloud() {
  if (points_.empty()) return {};
  foxglove::PointCloud cloud;
  stamp(cloud, cloud_start_);
  cloud.set_frame_id(kEnu);
  cloud.mutable_pose()->mutable_position();
  cloud.mutable_pose()->mutable_orientation()->set_w(1);
  describe_view<kPointFields>(cloud);
  cloud.set_data(std::move(points_));
  points_.clear();
  return write(kCloud, cloud_start_, cloud);
}

Status ViewWriter::append(const InsSolution& solution) {
  if (last_pose_ && solution.time - *last_pose_ < config_.pose_interval && solution.time >= *last_pose_) return {};
  last_pose_ = solution.time;
  const Transform<Ecef, Enu> T_ecef_local = ecef_from_enu(solution.position);
  const Transform<Enu, Enu> T_enu_local =
      T_enu_ecef_ * T_ecef_local;  // from the level at the vehicle to that of the drive
  const Eigen::Quaterniond R_enu_body = (T_enu_local.rotation * rotation_enu_body(solution.attitude)).normalized();
  foxglove::PoseInFrame pose;
  stamp(pose, solution.time);
  pose.set_frame_id(kEnu);
  set(*pose.mutable_pose()->mutable_position(), T_enu_local.translation);
  set(*pose.mutable_pose()->mutable_orientation(), R_enu_body);
  if (Status written = write(kPose, solution.time, pose); !written) return written;
  foxglove::FrameTransform transform;
  stamp(transform, solution.time);
  transform.set_parent_frame_id(kEnu);
  transform.set_child_frame_id(kBody);
  set(*transform.mutable_translation(), T_enu_local.translation);
  set(*transform.mutable_rotation(), R_enu_body);
  return write(kTransform, solution.time, transform);
}

Status ViewWriter::append(const GnssFix& fix) {
  foxglove::LocationFix message;
  stamp(message, fix.time);
  message.set_frame_id("antenna");
  message.set_latitude(fix.position.latitude * kDegPerRad);
  message.set_longitude(fix.position.longitude * kDegPerRad);
  message.set_altitude(fix.position.ellipsoidal_height);
  for (std::size_t i = 0; i < 9; ++i)
    message.add_position_covariance(i % 4 == 0 ? fix.sigma_enu[i / 4] * fix.sigma_enu[i / 4] : 0.0);
  message.set_position_covariance_type(foxglove::LocationFix::DIAGONAL_KNOWN);
  return write(kFix, fix.time, message);
}

Status ViewWriter::append(const Exposure& exposure, const std::string& camera) {
  if (!exposure.image.is_complete) return {};
  auto found = cameras_.find(camera);
  if (found == cameras_.end()) {
    const auto channel = static_cast<std::uint16_t>(kFirstImage + cameras_.size());
    if (Status added = mcap_.add_channel({channel, image_schema_, "/image/" + camera, "protobuf", {}}); !added)
      return added;
    found = cameras_.emplace(camera, std::pair{channel, std::optional<GpsTime>()}).first;
  }
  auto& [channel, last] = found->second;
  const GpsTime time = exposure.exposure_mid;
  if (last && time - *last < config_.image_interval && time >= *last) return {};
  last = time;
  Result<RgbImage> view = reduced_view(exposure.image, config_.image_longest_px);
  if (!view) return view.error();
  Result<Bytes> jpeg = encode_jpeg(*view, config_.jpeg_quality);
  if (!jpeg) return jpeg.error();
  foxglove::CompressedImage message;
  stamp(message, time);
  message.set_frame_id(camera);
  message.set_format("jpeg");
  message.set_data(jpeg->data(), jpeg->size());
  return write(channel, time, message);
}

Status ViewWriter::append_log(GpsTime time, Level level, const std::string& who, const std::string& text) {
  return write_log(kLog, time, level, who, text);
}

Status ViewWriter::append_health(GpsTime time, Level level, const std::string& who, const std::string& text) {
  return write_log(kHealth, time, level, who, text);
}

Status ViewWriter::write_log(Channel channel, GpsTime time, Level level, const std::string& who,
                             const std::string& text) {
  foxglove::Log message;
  stamp(message, time);
  message.set_level(static_cast<foxglove::Log::Level>(level));
  message.set_name(who);
  message.set_message(text);
  return write(channel, time, message);
}

Status ViewWriter::close() {
  const Status written = write_cloud();
  const Status closed = mcap_.close();
  return written ? closed : written;
}

}  // namespace hueline::storage
