#include "storage/view_messages.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "storage/descriptor_set.hpp"
#include "storage/image_view.hpp"
#include "storage/view_fields.hpp"
#include "storage_proto/foxglove/CameraCalibration.pb.h"
#include "storage_proto/foxglove/CompressedImage.pb.h"
#include "storage_proto/foxglove/FrameTransforms.pb.h"
#include "storage_proto/foxglove/LocationFix.pb.h"
#include "storage_proto/foxglove/Log.pb.h"
#include "storage_proto/foxglove/PoseInFrame.pb.h"

namespace hueline::storage {
namespace {

constexpr const char* kEnu = "enu";
constexpr const char* kBody = "body";
constexpr const char* kHead = "head";
constexpr const char* kAntenna = "antenna";
constexpr std::size_t kMostBytes = 9'000'000;  // bytes of points in one message

std::string lens_frame(const std::string& lens) { return "lens/" + lens; }

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

/// Describes the place and the axes of the frame `child` in `parent`.
template <class To, class From>
void set(foxglove::FrameTransform& out, GpsTime time, const std::string& parent, const std::string& child,
         const Transform<To, From>& T_parent_child) {
  stamp(out, time);
  out.set_parent_frame_id(parent);
  out.set_child_frame_id(child);
  set(*out.mutable_translation(), T_parent_child.translation);
  set(*out.mutable_rotation(), T_parent_child.rotation);
}

}  // namespace

std::string ViewMessages::Config::validate() const {
  if (keep_every == 0) return "keep_every must be at least 1";
  if (cloud_interval <= nanoseconds(0)) return "cloud_interval must be above 0";
  if (pose_interval < nanoseconds(0) || image_interval < nanoseconds(0))
    return "pose_interval and image_interval must not be below 0";
  if (image_longest_px < 16 || image_longest_px > 16384) return "image_longest_px must be from 16 to 16384";
  if (jpeg_quality < 1 || jpeg_quality > 100) return "jpeg_quality must be from 1 to 100";
  return {};
}

ViewMessages::ViewMessages(const Geodetic& origin, ViewRig rig, const Config& config)
    : origin_(origin), T_enu_ecef_(ecef_from_enu(origin).inverse()), rig_(std::move(rig)), config_(config) {
  // In the order of Channel.
  channel("/cloud", foxglove::PointCloud::default_instance());
  channel("/pose", foxglove::PoseInFrame::default_instance());
  channel("/tf", foxglove::FrameTransform::default_instance());
  channel("/tf_static", foxglove::FrameTransforms::default_instance());
  channel("/fix", foxglove::LocationFix::default_instance());
  channel("/log", foxglove::Log::default_instance());
  channel("/health", foxglove::Log::default_instance());
  for (const ViewLens& lens : rig_.lenses) {
    channel("/image/" + lens.camera, foxglove::CompressedImage::default_instance());
    channel("/camera/" + lens.name, foxglove::CameraCalibration::default_instance());
  }
}

std::size_t ViewMessages::channel(const std::string& topic, const google::protobuf::Message& type) {
  const auto [found, is_new] = by_topic_.emplace(topic, channels_.size());
  if (is_new) channels_.push_back({topic, type.GetDescriptor()->full_name(), descriptor_set(*type.GetDescriptor())});
  return found->second;
}

ViewMessage ViewMessages::message(std::size_t channel, GpsTime time, const google::protobuf::Message& message) const {
  return {channel, time, message.SerializeAsString()};
}

std::vector<ViewMessage> ViewMessages::make(const CloudBlock& block) {
  std::vector<ViewMessage> out;
  for (const ColouredPoint& p : block.points) {
    if (points_seen_++ % config_.keep_every != 0) continue;
    // A block of an older time, from another scanner, does not close the message. Only points of a later time do.
    if (!points_.empty() && (p.time - cloud_start_ >= config_.cloud_interval || points_.size() >= kMostBytes))
      std::ranges::move(make_rest_of_cloud(), std::back_inserter(out));
    if (points_.empty()) cloud_start_ = p.time;
    pack_view<kPointFields>(p, points_);
  }
  return out;
}

std::vector<ViewMessage> ViewMessages::make_rest_of_cloud() {
  if (points_.empty()) return {};
  foxglove::PointCloud cloud;
  stamp(cloud, cloud_start_);
  cloud.set_frame_id(kEnu);
  cloud.mutable_pose()->mutable_position();
  cloud.mutable_pose()->mutable_orientation()->set_w(1);
  describe_view<kPointFields>(cloud);
  cloud.set_data(std::move(points_));
  points_.clear();
  return {message(kCloud, cloud_start_, cloud)};
}

ViewMessage ViewMessages::static_frames(GpsTime time) const {
  foxglove::FrameTransforms all;
  for (const auto& [scanner, T_body_scanner] : rig_.scanners)
    set(*all.add_transforms(), time, kBody, "scanner/" + scanner, T_body_scanner);
  set(*all.add_transforms(), time, kBody, kHead, rig_.T_body_head);
  for (const ViewLens& lens : rig_.lenses)
    set(*all.add_transforms(), time, kHead, lens_frame(lens.name), lens.T_head_lens);
  return message(kStatic, time, all);
}

std::vector<ViewMessage> ViewMessages::make(const InsSolution& solution) {
  if (!is_on_earth(solution.position)) return {};  // the device knows no place, so there is nothing to show
  if (last_pose_ && solution.time - *last_pose_ < config_.pose_interval && solution.time >= *last_pose_) return {};
  last_pose_ = solution.time;
  const Transform<Ecef, Enu> T_ecef_local = ecef_from_enu(solution.position);
  const Transform<Enu, Enu> T_enu_local =
      T_enu_ecef_ * T_ecef_local;  // from the level at the vehicle to that of the drive
  const Transform<Enu, Body> T_enu_body{(T_enu_local.rotation * rotation_enu_body(solution.attitude)).normalized(),
                                        T_enu_local.translation};
  std::vector<ViewMessage> out;
  if (!std::exchange(has_static_, true)) out.push_back(static_frames(solution.time));
  foxglove::PoseInFrame pose;
  stamp(pose, solution.time);
  pose.set_frame_id(kEnu);
  set(*pose.mutable_pose()->mutable_position(), T_enu_body.translation);
  set(*pose.mutable_pose()->mutable_orientation(), T_enu_body.rotation);
  out.push_back(message(kPose, solution.time, pose));
  foxglove::FrameTransform transform;
  set(transform, solution.time, kEnu, kBody, T_enu_body);
  out.push_back(message(kTransform, solution.time, transform));
  return out;
}

std::vector<ViewMessage> ViewMessages::make(const GnssFix& fix) {
  foxglove::FrameTransform antenna;
  Transform<Enu, Enu> T_enu_antenna;
  T_enu_antenna.translation = (T_enu_ecef_ * to_ecef(fix.position)).xyz;
  set(antenna, fix.time, kEnu, kAntenna, T_enu_antenna);
  foxglove::LocationFix location;
  stamp(location, fix.time);
  location.set_frame_id(kAntenna);
  location.set_latitude(fix.position.latitude * kDegPerRad);
  location.set_longitude(fix.position.longitude * kDegPerRad);
  location.set_altitude(fix.position.ellipsoidal_height);
  for (std::size_t i = 0; i < 9; ++i)
    location.add_position_covariance(i % 4 == 0 ? fix.sigma_enu[i / 4] * fix.sigma_enu[i / 4] : 0.0);
  location.set_position_covariance_type(foxglove::LocationFix::DIAGONAL_KNOWN);
  return {message(kTransform, fix.time, antenna), message(kFix, fix.time, location)};
}

bool ViewMessages::wants(const Exposure& exposure, const std::string& camera) const {
  if (!exposure.image.is_complete) return false;
  const auto last = last_images_.find(camera);
  const GpsTime time = exposure.exposure_mid;
  return last == last_images_.end() || time - last->second >= config_.image_interval || time < last->second;
}

Result<std::vector<ViewMessage>> ViewMessages::make(const Exposure& exposure, const std::string& camera) {
  if (!wants(exposure, camera)) return std::vector<ViewMessage>{};
  const GpsTime time = exposure.exposure_mid;
  last_images_[camera] = time;
  Result<RgbImage> view = reduced_view(exposure.image, config_.image_longest_px);
  if (!view) return view.error();
  Result<Bytes> jpeg = encode_jpeg(*view, config_.jpeg_quality);
  if (!jpeg) return jpeg.error();
  std::vector<const ViewLens*> lenses;
  for (const ViewLens& lens : rig_.lenses)
    if (lens.camera == camera) lenses.push_back(&lens);
  foxglove::CompressedImage image;
  stamp(image, time);
  // Lenses that share an image look in different directions, so the image itself has the frame of the head.
  image.set_frame_id(lenses.size() == 1 ? lens_frame(lenses.front()->name) : kHead);
  image.set_format("jpeg");
  image.set_data(jpeg->data(), jpeg->size());
  std::vector<ViewMessage> out;
  out.push_back(message(channel("/image/" + camera, image), time, image));
  for (const ViewLens* lens : lenses)
    out.push_back(calibration(*lens, time, exposure.image, view->width, view->height));
  return out;
}

/// Describes the lens in the reduced image of `width` x `height` pixels of its camera.
ViewMessage ViewMessages::calibration(const ViewLens& lens, GpsTime time, const Image& image, int width, int height) {
  const double cell = reduction(image, config_.image_longest_px);
  const Eigen::Vector2d offset(lens.x_offset, lens.y_offset), half(0.5, 0.5);
  const Eigen::Vector2d focal = lens.focal_px / cell;
  const Eigen::Vector2d centre = (lens.principal_point_px + offset + half) / cell - half;
  foxglove::CameraCalibration out;
  stamp(out, time);
  out.set_frame_id(lens_frame(lens.name));
  out.set_width(static_cast<std::uint32_t>(width));
  out.set_height(static_cast<std::uint32_t>(height));
  out.set_distortion_model(lens.is_fisheye ? "kannala_brandt" : "plumb_bob");
  for (const double d : lens.distortion) out.add_d(d);
  for (const double k : {focal.x(), 0.0, centre.x(), 0.0, focal.y(), centre.y(), 0.0, 0.0, 1.0}) out.add_k(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) out.add_r(r);
  for (const double p : {focal.x(), 0.0, centre.x(), 0.0, 0.0, focal.y(), centre.y(), 0.0, 0.0, 0.0, 1.0, 0.0})
    out.add_p(p);
  return message(channel("/camera/" + lens.name, out), time, out);
}

std::vector<ViewMessage> ViewMessages::make_log(GpsTime time, Level level, const std::string& who,
                                                const std::string& text) {
  return line(kLog, time, level, who, text);
}

std::vector<ViewMessage> ViewMessages::make_health(GpsTime time, Level level, const std::string& who,
                                                   const std::string& text) {
  return line(kHealth, time, level, who, text);
}

std::vector<ViewMessage> ViewMessages::line(Channel channel, GpsTime time, Level level, const std::string& who,
                                            const std::string& text) const {
  foxglove::Log out;
  stamp(out, time);
  out.set_level(static_cast<foxglove::Log::Level>(level));
  out.set_name(who);
  out.set_message(text);
  return {message(channel, time, out)};
}

}  // namespace hueline::storage
