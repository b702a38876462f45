// Messages in Foxglove's schemas, written by protobuf's generated code, and read as messages of ROS.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "core/base64.hpp"
#include "drivers/ros/ros_cloud.hpp"
#include "drivers/ros/ros_pose_message.hpp"
#include "rosbag/bag.hpp"
#include "rosbag/foxglove_message.hpp"
#include "storage/descriptor_set.hpp"
#include "storage_proto/foxglove/CameraCalibration.pb.h"
#include "storage_proto/foxglove/CompressedImage.pb.h"
#include "storage_proto/foxglove/FrameTransforms.pb.h"
#include "storage_proto/foxglove/LocationFix.pb.h"
#include "storage_proto/foxglove/PointCloud.pb.h"
#include "storage_proto/foxglove/PoseInFrame.pb.h"
#include "tests/rosbag/sample_bag.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

using drivers::RosEncoding;
using drivers::RosReader;
using rosbag::FoxgloveReader;

constexpr std::int64_t kFoxglove_ns = 1'700'000'000'123'456'789;

template <class Message>
storage::McapSchema schema_of(const Message& message) {
  return {1, message.GetDescriptor()->full_name(), "protobuf", storage::descriptor_set(*message.GetDescriptor())};
}
void stamp(google::protobuf::Timestamp& time) {
  time.set_seconds(kFoxglove_ns / 1'000'000'000);
  time.set_nanos(kFoxglove_ns % 1'000'000'000);
}

/// A message as the reader gives it.
struct Turned {
  std::string type;
  Buffer bytes;
  RosReader in() const { return {bytes.bytes(), RosEncoding::Ros1}; }
};
Turned turned(const storage::McapSchema& schema, const std::string& encoding, const std::string& bytes) {
  const auto reader = FoxgloveReader::make(schema, encoding);
  if (!reader.ok()) return {reader.error().message, {}};
  auto out = (*reader)->turned(std::as_bytes(std::span(bytes)));
  return out.ok() ? Turned{(*reader)->type(), *out} : Turned{out.error().message, {}};
}
template <class Message>
Turned turned(const Message& message) {
  return turned(schema_of(message), "protobuf", message.SerializeAsString());
}

foxglove::PointCloud cloud_of_two_points() {
  foxglove::PointCloud cloud;
  stamp(*cloud.mutable_timestamp());
  cloud.set_frame_id("laser");
  cloud.set_point_stride(14);
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    auto& field = *cloud.add_fields();
    field.set_name(name);
    field.set_type(foxglove::PackedElementField::FLOAT32);
    field.set_offset(offset);
    offset += 4;
  }
  auto& field = *cloud.add_fields();
  field.set_name("intensity");
  field.set_type(foxglove::PackedElementField::UINT16);
  field.set_offset(offset);
  for (const float first : {1.f, 4.f}) {
    for (const float value : {first, first + 1, first + 2})
      cloud.mutable_data()->append(reinterpret_cast<const char*>(&value), 4);
    const auto intensity = static_cast<std::uint16_t>(1000 * first);
    cloud.mutable_data()->append(reinterpret_cast<const char*>(&intensity), 2);
  }
  return cloud;
}

void expect_point(const Turned& turned, std::size_t i, const Eigen::Vector3d& place, double intensity) {
  ASSERT_EQ(turned.type, "sensor_msgs/PointCloud2");
  const auto cloud = drivers::take_cloud(turned.type, turned.in());
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(count_ns(cloud->header.stamp), kFoxglove_ns);
  EXPECT_EQ(cloud->header.frame, "laser");
  ASSERT_EQ(cloud->size(), 2u);
  const auto value = [&](const char* name) { return value_of(*cloud, *cloud->find(name), cloud->point(i)); };
  EXPECT_NEAR((Eigen::Vector3d(value("x"), value("y"), value("z")) - place).norm(), 0, 1e-6);
  EXPECT_EQ(value("intensity"), intensity);
}

TEST(Foxglove, ACloudIsOneOfRos) {
  const auto cloud = cloud_of_two_points();
  expect_point(turned(cloud), 0, {1, 2, 3}, 1000);
  expect_point(turned(cloud), 1, {4, 5, 6}, 4000);
}

TEST(Foxglove, ThePoseOfACloudIsApplied) {
  auto cloud = cloud_of_two_points();
  cloud.mutable_pose()->mutable_position()->set_x(10);
  expect_point(turned(cloud), 0, {11, 2, 3}, 1000);
  // A quarter turn to the left.
  cloud.mutable_pose()->mutable_orientation()->set_z(std::sqrt(0.5));
  cloud.mutable_pose()->mutable_orientation()->set_w(std::sqrt(0.5));
  expect_point(turned(cloud), 1, {5, 4, 6}, 4000);
}

/// The lens of the CameraCalibrations here.
void expect_calibration(RosReader in) {
  EXPECT_EQ(in.take_header().frame, "cam");
  EXPECT_EQ(in.take<std::uint32_t>(), 480u);
  EXPECT_EQ(in.take<std::uint32_t>(), 640u);
  EXPECT_EQ(in.take_string(), "plumb_bob");
  ASSERT_EQ(in.take<std::uint32_t>(), 5u);
  for (const double value : {0.1, 0.2, 0., 0., 0.}) EXPECT_EQ(in.take<double>(), value);
  for (const double value : {500., 0., 320., 0., 501., 240., 0., 0., 1.}) EXPECT_EQ(in.take<double>(), value);
  for (int i = 0; i < 9 + 12; ++i) EXPECT_EQ(in.take<double>(), 0);
  EXPECT_TRUE(in.ok());
}

/// A program's own version of a schema may number its fields otherwise.
TEST(Foxglove, FieldsAreFoundByTheirNames) {
  google::protobuf::FileDescriptorSet files;
  ASSERT_TRUE(files.ParseFromString(schema_of(foxglove::CompressedImage()).data));
  for (auto& file : *files.mutable_file())
    for (auto& message : *file.mutable_message_type())
      for (auto& field : *message.mutable_field())
        if (message.name() == "CompressedImage") field.set_number(field.number() + 20);
  // The program has no file of its own for the time stamp.
  for (int i = 0; i < files.file_size(); ++i)
    if (files.file(i).name() == "google/protobuf/timestamp.proto") files.mutable_file()->DeleteSubrange(i--, 1);
  const std::string message(
      "\xAA\x01\x02\x08\x05\xB2\x01\x03"
      "abc\xBA\x01\x03"
      "png\xC2\x01\x03"
      "cam",
      23);
  const Turned read =
      turned({1, "foxglove.CompressedImage", "protobuf", files.SerializeAsString()}, "protobuf", message);
  ASSERT_EQ(read.type, "foxglove_msgs/CompressedImage");
  RosReader in = read.in();
  EXPECT_EQ(in.take_time(), UnixTime(std::chrono::seconds(5)));
  EXPECT_EQ(in.take_string(), "cam");
  EXPECT_EQ(in.take_string(), "abc");
  EXPECT_EQ(in.take_string(), "png");
}

TEST(Foxglove, TransformsPosesAndFixes) {
  foxglove::FrameTransforms transforms;
  for (const char* child : {"laser", "camera"}) {
    auto& one = *transforms.add_transforms();
    stamp(*one.mutable_timestamp());
    one.set_parent_frame_id("base_link");
    one.set_child_frame_id(child);
    one.mutable_translation()->set_z(2);
    one.mutable_rotation()->set_x(1);
  }
  transforms.mutable_transforms(1)->clear_rotation();
  const Turned tree = turned(transforms);
  EXPECT_EQ(tree.type, "tf2_msgs/TFMessage");
  const auto read = drivers::take_transforms(tree.in());
  ASSERT_TRUE(read && read->size() == 2);
  EXPECT_EQ(read->at(0).parent, "base_link");
  EXPECT_EQ(read->at(1).child, "camera");
  EXPECT_EQ(count_ns(read->at(1).time), kFoxglove_ns);
  EXPECT_EQ(read->at(0).T_parent_child.translation().z(), 2);
  EXPECT_NEAR(read->at(0).T_parent_child.linear()(1, 1), -1, 1e-12);
  EXPECT_TRUE(read->at(1).T_parent_child.linear().isIdentity());

  foxglove::PoseInFrame pose;
  stamp(*pose.mutable_timestamp());
  pose.set_frame_id("map");
  pose.mutable_pose()->mutable_position()->set_y(7);
  pose.mutable_pose()->mutable_orientation()->set_w(1);
  const auto local =
      drivers::take_local_pose("geometry_msgs/PoseStamped", turned(pose).in(), drivers::RosMetres::AboutPlace);
  ASSERT_TRUE(local);
  EXPECT_EQ(local->frame, "map");
  EXPECT_EQ(local->enu.y(), 7);

  foxglove::LocationFix fix;
  stamp(*fix.mutable_timestamp());
  fix.set_latitude(10);
  fix.set_longitude(-20);
  fix.set_altitude(300);
  for (int i = 0; i < 9; ++i) fix.add_position_covariance(i % 4 == 0 ? 4 : 0);
  fix.set_position_covariance_type(foxglove::LocationFix::KNOWN);
  const auto position = drivers::take_position("sensor_msgs/NavSatFix", turned(fix).in());
  ASSERT_TRUE(position && position->sigma_enu);
  EXPECT_EQ(position->place.ellipsoidal_height, 300);
  EXPECT_EQ(position->sigma_enu->z(), 2);
}

TEST(Foxglove, JsonSaysTheSame) {
  // 1 2 3 and 4 5 6 in base 64.
  const std::string text = R"({"timestamp": {"sec": 1700000000, "nsec": 123456789}, "frame_id": "laser",
    "pose": {"position": {"x": 0, "y": 0, "z": 10}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "point_stride": 14,
    "fields": [{"name": "x", "offset": 0, "type": 7}, {"name": "y", "offset": 4, "type": 7},
               {"name": "z", "offset": 8, "type": 7}, {"name": "intensity", "offset": 12, "type": 3}],
    "data": "AACAPwAAAEAAAEBA6AMAAIBAAACgQAAAwECgDw=="})";
  const storage::McapSchema schema{1, "foxglove.PointCloud", "jsonschema", "{}"};
  expect_point(turned(schema, "json", text), 0, {1, 2, 13}, 1000);
  expect_point(turned(schema, "json", text), 1, {4, 5, 16}, 4000);
  for (std::size_t size = 0; size < text.size(); ++size)
    EXPECT_TRUE(turned(schema, "json", text.substr(0, size)).type.starts_with("it does not have the form")) << size;
}

/// A scan with one plane, 10 m above its frame and turned to the left by a quarter.
TEST(Foxglove, AScanIsACloud) {
  const std::string text = R"({"timestamp": {"sec": 1700000000, "nsec": 123456789}, "frame_id": "laser",
    "pose": {"position": {"x": 0, "y": 0, "z": 10}, "orientation": {"x": 0, "y": 0, "z": 0.70710678118654752,
                                                                    "w": 0.70710678118654752}},
    "start_angle": -1, "end_angle": 1, "ranges": [2, 0, 4], "intensities": [5, 6, 7]})";
  const storage::McapSchema schema{1, "foxglove.LaserScan", "jsonschema", "{}"};
  const auto scan = turned(schema, "json", text);
  ASSERT_EQ(scan.type, "sensor_msgs/PointCloud2");
  const auto cloud = drivers::take_cloud(scan.type, scan.in());
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  ASSERT_EQ(cloud->size(), 3u);
  EXPECT_EQ(cloud->header.frame, "laser");
  const auto value = [&](const char* name, std::size_t i) {
    return value_of(*cloud, *cloud->find(name), cloud->point(i));
  };
  EXPECT_NEAR(value("x", 0), 2 * std::sin(1), 1e-6);
  EXPECT_NEAR(value("y", 0), 2 * std::cos(1), 1e-6);
  EXPECT_NEAR(value("z", 0), 10, 1e-6);
  EXPECT_EQ(value("intensity", 2), 7);
  for (const char* axis : {"x", "y", "z"}) EXPECT_EQ(value(axis, 1), 0) << "a range of 0 is no return";
  for (const RosEncoding encoding : {RosEncoding::Cdr, RosEncoding::Ros1}) {
    test::RosWriter out(encoding);
    out.time(kFoxglove_ns).text("laser");
    for (const double number : {0., 0., 0., 0., 0., 0., 1., 0., 0.5}) out.put(number);
    out.put(std::uint32_t{2}).put(3.0).put(4.0).put(std::uint32_t{0});
    const auto reader = FoxgloveReader::of_ros("foxglove_msgs/LaserScan", encoding);
    ASSERT_TRUE(reader);
    const auto plain = reader->turned(std::as_bytes(std::span(out.bytes())));
    ASSERT_TRUE(plain.ok()) << plain.error().message;
    const auto points = drivers::take_cloud(reader->type(), {plain->bytes(), RosEncoding::Ros1});
    ASSERT_TRUE(points.ok());
    ASSERT_EQ(points->size(), 2u);
    EXPECT_EQ(value_of(*points, *points->find("x"), points->point(0)), 3);
    EXPECT_NEAR(value_of(*points, *points->find("y"), points->point(1)), 4 * std::sin(0.5), 1e-6);
    EXPECT_EQ(points->find("intensity"), nullptr) << "it has none";
  }
}

TEST(Foxglove, SeveralPosesAreAPoseArray) {
  const std::string text = R"({"timestamp": {"sec": 1700000000, "nsec": 123456789}, "frame_id": "map", "poses": [
    {"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}]})";
  const auto poses = turned({1, "foxglove.PosesInFrame", "jsonschema", "{}"}, "json", text);
  ASSERT_EQ(poses.type, "geometry_msgs/PoseArray");
  const auto one = drivers::take_local_pose(poses.type, poses.in(), drivers::RosMetres::AboutPlace);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->frame, "map");
  EXPECT_EQ(one->enu, Eigen::Vector3d(1, 2, 3));
}

/// Made by flatc of Foxglove's schema, of the cloud and the pose in JsonSaysTheSame.
constexpr const char* kFlatCloud =
    "FAAAABAAIAAEAAwAEAAUABgAHAAQAAAAAPFTZRXNWwf0AAAAwAAAAA4AAAAoAAAABAAAABwAAAAAAIA/AAAAQAAAQEDoAwAAgEAA"
    "AKBAAADAQKAPBAAAAHAAAABMAAAAKAAAAAQAAADK////AAAAAwgAAAAMAAAACQAAAGludGVuc2l0eQAAAOr///8AAAAHCAAAAAgA"
    "AAABAAAAegAKABAACAAMAAcACgAAAAAAAAcIAAAABAAAAAEAAAB5AAoADAAIAAAABwAKAAAAAAAABwQAAAABAAAAeAAAAAgADAAE"
    "AAgACAAAABwAAAAIAAAABAAGAAQAAAAAAAoAEAAAAAAABAAKAAAAAAAAAAAAJEAAAAAABQAAAGxhc2VyAAAA";

storage::McapSchema flat_schema(const std::string& name) { return {1, "foxglove." + name, "flatbuffer", ""}; }
Turned turned_flat(const std::string& name, const std::string& base64) {
  return turned(flat_schema(name), "flatbuffer", from_base64(base64).value());
}

TEST(Foxglove, FlatbuffersSayTheSame) {
  expect_point(turned_flat("PointCloud", kFlatCloud), 0, {1, 2, 13}, 1000);
  expect_point(turned_flat("PointCloud", kFlatCloud), 1, {4, 5, 16}, 4000);

  const Turned calibration =
      turned_flat("CameraCalibration",
                  "IAAAAAAAAAAAABYALAAEAAwAEAAUABgAHAAgACQAKAAWAAAAAPFTZRXNWwe0AAAAgAIAAOABAACYAAAAaAAAABQAAAAMAAAABAAA"
                  "AAAAAAAAAAAACQAAAAAAAAAAQH9AAAAAAAAAAAAAAAAAAAB0QAAAAAAAAAAAAAAAAABQf0AAAAAAAABuQAAAAAAAAAAAAAAAAAAA"
                  "AAAAAAAAAADwPwAAAAAFAAAAmpmZmZmZuT+amZmZmZnJPwAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAkAAABwbHVtYl9ib2IAAAAD"
                  "AAAAY2FtAA==");
  ASSERT_EQ(calibration.type, "sensor_msgs/CameraInfo");
  expect_calibration(calibration.in());

  const Turned fix =
      turned_flat("LocationFix",
                  "GAAAAAAAEgA0AAgAEAAYACAAKAAUAAcAEgAAAAAAAAMA8VNlFc1bB3AAAAAgAAAAAAAAAAAAJEAAAAAAAAA0wAAAAAAAwHJAAAAA"
                  "AAkAAAAAAAAAAAAQQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAABBAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
                  "EEADAAAAZ3BzAA==");
  const auto position = drivers::take_position(fix.type, fix.in());
  ASSERT_TRUE(position && position->sigma_enu);
  EXPECT_EQ(position->place.ellipsoidal_height, 300);
  EXPECT_EQ(position->sigma_enu->z(), 2);
}

/// A table of flatbuffers with doubles, by their number: what is not named is left out.
std::string flat_doubles(const std::map<std::size_t, double>& values) {
  const std::size_t slots = values.empty() ? 0 : values.rbegin()->first + 1;
  std::string list(4 + 2 * slots, '\0'), table(4, '\0');
  const auto put = [](std::string& out, std::size_t at, auto value) { std::memcpy(&out[at], &value, sizeof value); };
  for (const auto& [slot, value] : values) {
    put(list, 4 + 2 * slot, static_cast<std::uint16_t>(table.size()));
    table.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  put(list, 0, static_cast<std::uint16_t>(list.size()));
  put(list, 2, static_cast<std::uint16_t>(table.size()));
  put(table, 0, static_cast<std::int32_t>(list.size()));
  return list + table;
}

/// Foxglove's schema says since 2025 that a w which is left out is 1; before it was 0.
TEST(Foxglove, AFlatbufferLeavesOutTheWOfHalfATurnOrOfNone) {
  const auto rotation = [](const std::map<std::size_t, double>& xyzw) {
    const std::string part = flat_doubles(xyzw);
    // A transform with nothing but its rotation, field 4, whose table stands behind it.
    std::string list(14, '\0'), table(8, '\0'), root(4, '\0');
    const auto put = [](std::string& out, std::size_t at, auto value) { std::memcpy(&out[at], &value, sizeof value); };
    put(list, 0, std::uint16_t{14}), put(list, 2, std::uint16_t{8}), put(list, 12, std::uint16_t{4});
    const std::size_t list_of_part = 4 + 2 * (xyzw.empty() ? 0 : xyzw.rbegin()->first + 1);
    put(root, 0, static_cast<std::uint32_t>(4 + list.size()));
    put(table, 0, static_cast<std::int32_t>(list.size()));
    put(table, 4, static_cast<std::uint32_t>(4 + list_of_part));
    const Turned tree = turned(flat_schema("FrameTransform"), "flatbuffer", root + list + table + part);
    const auto read = drivers::take_transforms(tree.in());
    return read && read->size() == 1 ? Eigen::Matrix3d(read->at(0).T_parent_child.linear()) : Eigen::Matrix3d::Zero();
  };
  EXPECT_TRUE(rotation({}).isIdentity());
  EXPECT_TRUE(rotation({{2, 1e-9}}).isIdentity(1e-6));
  EXPECT_TRUE(rotation({{2, 1}}).isApprox(Eigen::Vector3d(-1, -1, 1).asDiagonal().toDenseMatrix()));
  EXPECT_TRUE(rotation({{2, 1}, {3, 0}}).isApprox(Eigen::Vector3d(-1, -1, 1).asDiagonal().toDenseMatrix()));
  EXPECT_NEAR(rotation({{2, std::sqrt(0.5)}, {3, std::sqrt(0.5)}})(1, 0), 1, 1e-9);
}

/// A message of foxglove_msgs, with a stamp and a frame as all of them begin.
test::RosWriter foxglove_msg(RosEncoding encoding, const std::string& frame) {
  test::RosWriter out(encoding);
  out.time(kFoxglove_ns).text(frame);
  return out;
}
std::string ros_cloud_of_two_points(RosEncoding encoding) {
  const auto cloud = cloud_of_two_points();
  test::RosWriter out = foxglove_msg(encoding, "laser");
  for (const double value : {0., 0., 10., 0., 0., 0., 1.}) out.put(value);  // its pose: 10 m above the frame
  out.put(std::uint32_t{14}).put(static_cast<std::uint32_t>(cloud.fields_size()));
  for (const auto& field : cloud.fields())
    out.text(field.name()).put(field.offset()).put(static_cast<std::uint8_t>(field.type()));
  return out.sequence(cloud.data()).bytes();
}
Turned turned_ros(const std::string& type, RosEncoding encoding, const std::string& bytes) {
  const auto reader = FoxgloveReader::of_ros(type, encoding);
  if (!reader) return {"none", {}};
  auto out = reader->turned(std::as_bytes(std::span(bytes)));
  return out.ok() ? Turned{reader->type(), *out} : Turned{out.error().message, {}};
}

TEST(Foxglove, MessagesOfRosSayTheSame) {
  for (const RosEncoding encoding : {RosEncoding::Cdr, RosEncoding::Ros1}) {
    const auto cloud = turned_ros("foxglove_msgs/PointCloud", encoding, ros_cloud_of_two_points(encoding));
    expect_point(cloud, 0, {1, 2, 13}, 1000);
    expect_point(cloud, 1, {4, 5, 16}, 4000);

    test::RosWriter lens = foxglove_msg(encoding, "cam");
    lens.put(std::uint32_t{640}).put(std::uint32_t{480}).text("plumb_bob").put(std::uint32_t{5});
    for (const double value : {0.1, 0.2, 0., 0., 0.}) lens.put(value);
    for (const double value : {500., 0., 320., 0., 501., 240., 0., 0., 1.}) lens.put(value);
    for (int i = 0; i < 9 + 12; ++i) lens.put(0.);
    const auto calibration = turned_ros("foxglove_msgs/CameraCalibration", encoding, lens.bytes());
    ASSERT_EQ(calibration.type, "sensor_msgs/CameraInfo");
    expect_calibration(calibration.in());

    test::RosWriter transforms(encoding);
    transforms.put(std::uint32_t{2});
    for (const char* child : {"laser", "camera"}) {
      transforms.time(kFoxglove_ns).text("base_link").text(child);
      for (const double value : {0., 0., 2., 1., 0., 0., 0.}) transforms.put(value);
    }
    const auto tree = turned_ros("foxglove_msgs/FrameTransforms", encoding, transforms.bytes());
    const auto read = drivers::take_transforms(tree.in());
    ASSERT_TRUE(read && read->size() == 2);
    EXPECT_EQ(read->at(1).parent, "base_link");
    EXPECT_EQ(read->at(1).child, "camera");
    EXPECT_EQ(read->at(1).T_parent_child.translation().z(), 2);
    EXPECT_NEAR(read->at(1).T_parent_child.linear()(1, 1), -1, 1e-12);

    test::RosWriter odometry = foxglove_msg(encoding, "odom");
    odometry.text("base_link");
    for (const double value : {1., 2., 3., 0., 0., 1., 0.}) odometry.put(value);
    for (int i = 0; i < 6; ++i) odometry.put(5.);
    for (int i = 0; i < 36; ++i) odometry.put(i % 7 == 0 ? 0.04 : 0);
    for (int i = 0; i < 36; ++i) odometry.put(0.);
    const auto moved = turned_ros("foxglove_msgs/Odometry", encoding, odometry.bytes());
    const auto local = drivers::take_local_pose(moved.type, moved.in(), drivers::RosMetres::AboutPlace);
    ASSERT_TRUE(local && local->sigma_enu) << moved.type;
    EXPECT_EQ(local->frame + local->body, "odombase_link");
    EXPECT_EQ(local->enu, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(local->q_enu_flu.z(), 1);
    EXPECT_NEAR(local->sigma_enu->y(), 0.2, 1e-12);

    test::RosWriter fix = foxglove_msg(encoding, "gps");
    for (const double value : {10., -20., 300., 4., 0., 0., 0., 4., 0., 0., 0., 4.}) fix.put(value);
    fix.put(std::uint8_t{3});
    // Later versions of the schema have further fields.
    for (const std::string& bytes : {fix.bytes(), fix.bytes() + std::string(40, '\x01')}) {
      const auto place = turned_ros("foxglove_msgs/LocationFix", encoding, bytes);
      const auto position = drivers::take_position(place.type, place.in());
      ASSERT_TRUE(position && position->sigma_enu);
      EXPECT_EQ(position->place.ellipsoidal_height, 300);
      EXPECT_EQ(position->sigma_enu->z(), 2);
    }
  }
  // Images are read as they are.
  EXPECT_EQ(turned_ros("foxglove_msgs/RawImage", RosEncoding::Cdr, "").type, "none");
  EXPECT_EQ(turned_ros("foxglove_msgs/Grid", RosEncoding::Cdr, "").type, "none");
}

TEST(Foxglove, TopicsOfRosInEachFormatOfRecordings) {
  const test::TemporaryFolder folder;
  const auto messages = [](RosEncoding encoding) {
    const std::string cloud = ros_cloud_of_two_points(encoding);
    return std::vector<test::SampleMessage>{
        {"/laser", "foxglove_msgs/PointCloud", kFoxglove_ns, cloud},
        {"/laser", "foxglove_msgs/PointCloud", kFoxglove_ns, cloud.substr(0, cloud.size() - 1)},
        {"/laser", "foxglove_msgs/PointCloud", kFoxglove_ns, cloud}};
  };
  test::write_mcap(folder / "of.mcap", messages(RosEncoding::Cdr), storage::Compression::None);
  test::write_sqlite(folder / "of.db3", messages(RosEncoding::Cdr));
  test::write_file(folder / "of.bag",
                   test::ros1_bag(messages(RosEncoding::Ros1), "none", [](const std::string& chunk) { return chunk; }));
  for (const char* name : {"of.mcap", "of.db3", "of.bag"}) {
    auto bag = rosbag::open_bag(folder / name);
    ASSERT_TRUE(bag.ok()) << name;
    const auto first = (*bag)->next();
    ASSERT_TRUE(first.ok()) << name << ": " << first.error().message;
    const rosbag::BagTopic topic = (*bag)->topics().at(0);
    EXPECT_EQ(topic.type, "sensor_msgs/PointCloud2") << name;
    EXPECT_EQ(topic.written_type, "foxglove_msgs/PointCloud") << name;
    expect_point({topic.type, first->data}, 1, {4, 5, 16}, 4000);
    EXPECT_EQ((*bag)->next().error().code, ErrorCode::Malformed) << name;
    EXPECT_TRUE((*bag)->next().ok()) << name;
    EXPECT_EQ((*bag)->next().error().code, ErrorCode::EndOfData) << name;
  }
}

TEST(Foxglove, SaysWhatItDoesNotRead) {
  const auto cloud = cloud_of_two_points();
  auto schema = schema_of(cloud);
  EXPECT_EQ(turned(schema, "cbor", "").type, "its messages are not of ROS but \"cbor\"");
  schema.data = "none";
  EXPECT_EQ(turned(schema, "protobuf", "").type, "the recording has no schema of its messages in protobuf");
  const std::string bytes = cloud.SerializeAsString();
  EXPECT_TRUE(turned(schema_of(cloud), "protobuf", bytes.substr(0, bytes.size() - 1)).type.starts_with("it does not"));
  // Fields of other types than Foxglove's are told, too.
  google::protobuf::FileDescriptorSet files;
  ASSERT_TRUE(files.ParseFromString(schema_of(cloud).data));
  for (auto& file : *files.mutable_file())
    for (auto& message : *file.mutable_message_type())
      for (auto& field : *message.mutable_field())
        if (field.name() == "frame_id") field.set_type(google::protobuf::FieldDescriptorProto::TYPE_INT32);
  schema.data = files.SerializeAsString();
  EXPECT_EQ(turned(schema, "protobuf", bytes).type, "it does not have the form of its schema (frame_id)");
}

/// A message that is damaged is turned or told, whatever it claims, and so is one whose schema is damaged.
TEST(Foxglove, DamagedBytesEndNothing) {
  const auto take = [](const storage::McapSchema& schema, const std::string& encoding, const std::string& bytes) {
    const Turned out = turned(schema, encoding, bytes);
    if (out.type == "sensor_msgs/PointCloud2") {
      if (const auto cloud = drivers::take_cloud(out.type, out.in()); cloud.ok()) {
        EXPECT_LE(cloud->size(), bytes.size());
      }
    } else {
      EXPECT_THAT(out.type, testing::AnyOf(testing::HasSubstr("the form of its schema"),
                                           testing::HasSubstr("has no schema of its messages")));
    }
  };
  const auto damage = [](const std::string& whole, const auto& use) {
    for (std::size_t at = 0; at < whole.size(); ++at) {
      use(whole.substr(0, at));
      for (const unsigned flip : {0x01u, 0x08u, 0x80u, 0xFFu}) {
        std::string changed = whole;
        changed[at] = static_cast<char>(static_cast<unsigned char>(changed[at]) ^ flip);
        use(changed);
      }
    }
  };
  const auto cloud = cloud_of_two_points();
  const storage::McapSchema schema = schema_of(cloud);
  const std::string bytes = cloud.SerializeAsString();
  damage(bytes, [&](const std::string& changed) { take(schema, "protobuf", changed); });
  damage(schema.data, [&](const std::string& changed) {
    storage::McapSchema other = schema;
    other.data = changed;
    take(other, "protobuf", bytes);
  });
  const std::string json = R"({"timestamp":{"sec":1700000000,"nsec":5},"frame_id":"laser","point_stride":4,)"
                           R"("fields":[{"name":"x","offset":0,"type":7}],"data":"AACAPw=="})";
  damage(from_base64(kFlatCloud).value(),
         [&](const std::string& changed) { take(flat_schema("PointCloud"), "flatbuffer", changed); });
  for (const RosEncoding encoding : {RosEncoding::Cdr, RosEncoding::Ros1})
    damage(ros_cloud_of_two_points(encoding), [&](const std::string& changed) {
      const Turned out = turned_ros("foxglove_msgs/PointCloud", encoding, changed);
      EXPECT_THAT(out.type, testing::AnyOf("sensor_msgs/PointCloud2", testing::HasSubstr("the form of its schema")));
    });
  damage(json, [&](const std::string& changed) {
    take({1, "foxglove.PointCloud", "jsonschema", ""}, "json", changed);
  });
}

TEST(Foxglove, ChannelsOfMcapAreTopics) {
  const test::TemporaryFolder folder;
  const auto cloud = cloud_of_two_points();
  for (const bool is_view : {false, true}) {
    storage::McapWriter::Config config;
    if (!is_view) config.library = "another program";
    config.if_exists = IfExists::Replace;
    auto writer = storage::McapWriter::create(folder / "fox.mcap", config);
    ASSERT_TRUE(writer.ok());
    const auto schema = writer->add_schema(schema_of(cloud));
    ASSERT_TRUE(schema.ok() && writer->add_channel({0, *schema, "/LIDAR_TOP", "protobuf", {}}).ok());
    for (const std::string& bytes : {cloud.SerializeAsString(), std::string("\xFF"), cloud.SerializeAsString()})
      ASSERT_TRUE(writer->write({0, 0, kFoxglove_ns, kFoxglove_ns}, storage::as_bytes(bytes)).ok());
    ASSERT_TRUE(writer->close().ok());
    EXPECT_EQ(rosbag::is_bag(folder / "fox.mcap"), !is_view);
    auto bag = rosbag::open_bag(folder / "fox.mcap");
    ASSERT_TRUE(bag.ok());
    const auto first = (*bag)->next();
    ASSERT_TRUE(first.ok());
    const rosbag::BagTopic& topic = (*bag)->topics().at(0);
    EXPECT_EQ(topic.name, "/LIDAR_TOP");
    if (is_view) {
      EXPECT_EQ(topic.trouble, "it is of a view of hueline, which shows a drive");
      continue;
    }
    EXPECT_EQ(topic.type, "sensor_msgs/PointCloud2");
    EXPECT_EQ(topic.written_type, "foxglove.PointCloud");
    EXPECT_EQ(topic.trouble, "");
    EXPECT_TRUE(drivers::take_cloud(topic.type, {first->data.bytes(), topic.encoding}).ok());
    EXPECT_EQ((*bag)->next().error().code, ErrorCode::Malformed);
    EXPECT_TRUE((*bag)->next().ok());
    EXPECT_EQ((*bag)->next().error().code, ErrorCode::EndOfData);
  }
}

}  // namespace
}  // namespace hueline
