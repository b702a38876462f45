// What `hueline inspect` says of recordings of ROS.
#include <gtest/gtest.h>

#include <span>

#include "apps/inspect/inspect.hpp"
#include "tests/rosbag/sample_bag.hpp"
#include "tests/support/pcap_writer.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

using test::SampleMessage;
using test::TemporaryFile;

constexpr std::int64_t kTime_ns = 1'700'000'000'000'000'000;

std::vector<SampleMessage> messages() {
  return {{"/scan", "velodyne_msgs/VelodyneScan", kTime_ns, "12345"},
          {"/text", "std_msgs/String", kTime_ns + 500'000'000, "1"},
          {"/scan", "velodyne_msgs/VelodyneScan", kTime_ns + 2'000'000'000, "1234567"}};
}

void expect_the_topics(const std::string& path) {
  const auto seen = apps::inspect_file(path);
  ASSERT_TRUE(seen.trouble.ok()) << seen.trouble.error().message;
  EXPECT_EQ(seen.found->at("format"), "recording of ROS");
  EXPECT_EQ(seen.found->at("messages"), 3);
  EXPECT_EQ(seen.found->at("begin"), "2023-11-14T22:13:20.000Z");
  EXPECT_EQ(seen.found->at("duration_s"), 2.0);
  const auto& topics = seen.found->at("topics");
  ASSERT_EQ(topics.size(), 2u);
  EXPECT_EQ(topics[0].at("topic"), "/scan");
  EXPECT_EQ(topics[0].at("type"), "velodyne_msgs/VelodyneScan");
  EXPECT_EQ(topics[0].at("messages"), 2);
  EXPECT_EQ(topics[0].at("bytes"), 12);
}

TEST(InspectBag, CountsTheMessagesOfEachTopic) {
  const TemporaryFile database("inspected.db3", {});
  test::write_sqlite(database.path(), messages());
  expect_the_topics(database.path());
  const TemporaryFile mcap("inspected.mcap", {});
  test::write_mcap(mcap.path(), messages(), storage::Compression::None);
  expect_the_topics(mcap.path());
  const std::string bag = test::ros1_bag(messages(), "none", [](const std::string& chunk) { return chunk; });
  expect_the_topics(TemporaryFile("inspected.bag", std::as_bytes(std::span(bag))).path());
}

/// Messages of another program are listed with the reason why they are not read, in a file as in a folder of files.
TEST(InspectBag, SaysOfForeignMessagesWhyTheyAreNotRead) {
  const test::TemporaryFolder folder;
  test::write_mcap(folder / "other.mcap", messages(), storage::Compression::None, "cbor");
  for (const std::string& path : {folder.path().string(), (folder / "other.mcap").string()}) {
    const auto seen = apps::inspect_file(path);
    ASSERT_TRUE(seen.found) << seen.trouble.error().message;
    EXPECT_TRUE(seen.trouble.ok());
    EXPECT_EQ(seen.found->at("format"), "recording, none of whose messages is read");
    EXPECT_EQ(seen.found->at("messages"), 3);
    ASSERT_EQ(seen.found->at("topics").size(), 2u);
    EXPECT_EQ(seen.found->at("topics")[0].at("not_readable"), "its messages are not of ROS but \"cbor\"");
  }
}

/// Writers describe a channel that has no message in the summary alone, or anywhere among the data.
TEST(InspectBag, ListsTopicsWithoutAMessage) {
  const TemporaryFile file("silent.mcap", {});
  storage::McapWriter::Config config;
  config.library = "another program";
  config.if_exists = IfExists::Replace;
  auto writer = storage::McapWriter::create(file.path(), config);
  ASSERT_TRUE(writer.ok());
  const auto schema = writer->add_schema({0, "sensor_msgs/msg/NavSatFix", "ros2msg", ""});
  ASSERT_TRUE(schema.ok() && writer->add_channel({0, *schema, "/fix", "cdr", {}}).ok() && writer->close().ok());
  const auto seen = apps::inspect_file(file.path());
  ASSERT_TRUE(seen.found) << seen.trouble.error().message;
  EXPECT_EQ(seen.found->at("format"), "recording of ROS");
  ASSERT_EQ(seen.found->at("topics").size(), 1u);
  EXPECT_EQ(seen.found->at("topics")[0].at("type"), "sensor_msgs/NavSatFix");
  EXPECT_EQ(seen.found->at("topics")[0].at("messages"), 0);
}

TEST(InspectBag, AFolderMayHoldARecordingWithoutAMessage) {
  const test::TemporaryFolder folder, other;
  const auto file = folder / "empty_0.db3";
  test::write_sqlite(file, messages());
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, "DELETE FROM messages", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
  const auto seen = apps::inspect_file(folder.path());
  ASSERT_TRUE(seen.found) << seen.trouble.error().message;
  EXPECT_EQ(seen.found->at("messages"), 0);
  EXPECT_FALSE(apps::inspect_file(other.path()).found) << "there is nothing in it";
}

TEST(InspectBag, ACutRecordingIsCountedAndTold) {
  std::string bag = test::ros1_bag(messages(), "none", [](const std::string& chunk) { return chunk; });
  bag.resize(bag.size() - 100);
  const TemporaryFile file("inspected_cut.bag", std::as_bytes(std::span(bag)));
  const auto seen = apps::inspect_file(file.path());
  ASSERT_TRUE(seen.found);
  EXPECT_EQ(seen.found->at("messages"), 2);
  EXPECT_FALSE(seen.trouble.ok());
}

TEST(InspectBag, SaysHowAnOldRecordingIsConverted) {
  const std::string bag = "#ROSRECORD V1.2\nand more bytes";
  const auto seen = apps::inspect_file(TemporaryFile("old.bag", std::as_bytes(std::span(bag))).path());
  ASSERT_FALSE(seen.trouble.ok());
  EXPECT_NE(seen.trouble.error().message.find("rosbag fix"), std::string::npos) << seen.trouble.error().message;
}

}  // namespace
}  // namespace hueline
