// Messages in Foxglove's schemas, written by protobuf's generated code, and read as messages of ROS.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>

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

TEST(Foxglove, SaysWhatItDoesNotRead) {
  const auto cloud = cloud_of_two_points();
  auto schema = schema_of(cloud);
  EXPECT_EQ(turned(schema, "flatbuffer", "").type, "its messages are not of ROS but \"flatbuffer\"");
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
