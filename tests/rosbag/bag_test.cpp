// Recordings of ROS in every format: the same messages come out, and what is cut or broken is told.
#include "rosbag/bag.hpp"
#include "rosbag/ordered_bag.hpp"
#include "rosbag/packed_file.hpp"

#include <bzlib.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include "drivers/transport/pcap_source.hpp"
#include "rosbag/scanner_files.hpp"
#include "storage/compression.hpp"
#include "tests/rosbag/sample_bag.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hueline {
namespace {

using drivers::RosEncoding;
using rosbag::open_bag;
using test::SampleMessage;

constexpr std::int64_t kBegin_ns = 1'700'000'000'123'456'789;

std::string data_of(int i) { return test::RosWriter(RosEncoding::Cdr).text("message " + std::to_string(i)).bytes(); }

std::vector<SampleMessage> sample() {
  std::vector<SampleMessage> out;
  for (int i = 0; i < 7; ++i)
    out.push_back({i % 3 == 0 ? "/imu/data" : "/chatter", i % 3 == 0 ? "sensor_msgs/Imu" : "std_msgs/String",
                   kBegin_ns + i * 100'000'000, data_of(i)});
  return out;
}

std::string packed_lz4(const std::string& s) {
  storage::Bytes out;
  const storage::ByteView all = storage::as_bytes(s);
  EXPECT_TRUE(storage::compress(storage::Compression::Lz4, std::span(&all, 1), out).ok());
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}
std::string packed_bz2(const std::string& s) {
  std::string out(s.size() + 1000, '\0'), in = s;
  auto size = static_cast<unsigned>(out.size());
  EXPECT_EQ(BZ2_bzBuffToBuffCompress(out.data(), &size, in.data(), static_cast<unsigned>(in.size()), 9, 0, 0), BZ_OK);
  out.resize(size);
  return out;
}

struct Read {
  std::vector<SampleMessage> messages;
  std::uint64_t damages = 0;
  ErrorCode end = ErrorCode::EndOfData;
};
Read read_all(const std::filesystem::path& path) {
  Read out;
  const auto bag = open_bag(path);
  if (!bag.ok()) {
    out.end = bag.error().code;
    return out;
  }
  for (;;) {
    const auto message = (*bag)->next();
    if (message.ok()) {
      const auto bytes = message->data.bytes();
      const auto& topic = (*bag)->topics().at(message->topic);
      out.messages.push_back({topic.name,
                              topic.type,
                              count_ns(message->received),
                              {reinterpret_cast<const char*>(bytes.data()), bytes.size()}});
    } else if (message.error().code != ErrorCode::Malformed) {
      out.end = message.error().code;
      return out;
    } else if (++out.damages > 1000) {
      ADD_FAILURE() << "one damage is told again and again: " << message.error().message;
      return out;
    }
  }
}
bool same(const SampleMessage& a, const SampleMessage& b) {
  return a.topic == b.topic && a.type == b.type && a.time_ns == b.time_ns && a.bytes == b.bytes;
}
void expect_sample(const Read& read, std::size_t count = 7) {
  const auto all = sample();
  ASSERT_EQ(read.messages.size(), count);
  for (std::size_t i = 0; i < count; ++i) EXPECT_TRUE(same(read.messages[i], all[i])) << i;
}

/// The sample in every format that is read.
std::vector<std::filesystem::path> write_all(const test::TemporaryFolder& folder) {
  test::write_mcap(folder / "plain.mcap", sample(), storage::Compression::None);
  test::write_mcap(folder / "zstd.mcap", sample(), storage::Compression::Zstd);
  test::write_mcap(folder / "lz4.mcap", sample(), storage::Compression::Lz4);
  test::write_sqlite(folder / "sqlite.db3", sample());
  const auto as_it_is = [](const std::string& s) { return s; };
  test::write_file(folder / "plain.bag", test::ros1_bag(sample(), "none", as_it_is));
  test::write_file(folder / "lz4.bag", test::ros1_bag(sample(), "lz4", packed_lz4));
  test::write_file(folder / "bz2.bag", test::ros1_bag(sample(), "bz2", packed_bz2));
  std::vector<std::filesystem::path> out;
  for (const char* name : {"plain.mcap", "zstd.mcap", "lz4.mcap", "sqlite.db3", "plain.bag", "lz4.bag", "bz2.bag"})
    out.push_back(folder / name);
  return out;
}

TEST(Bag, EveryFormatGivesTheSameMessages) {
  const test::TemporaryFolder folder;
  for (const auto& path : write_all(folder)) {
    SCOPED_TRACE(path);
    EXPECT_TRUE(rosbag::is_bag(path));
    const Read read = read_all(path);
    EXPECT_EQ(read.end, ErrorCode::EndOfData);
    EXPECT_EQ(read.damages, 0u);
    expect_sample(read);
  }
}

TEST(Bag, AFolderIsReadInTheOrderOfItsNumbers) {
  const test::TemporaryFolder folder;
  const auto all = sample();
  for (int i = 0; i < 7; ++i)  // name_2 before name_10
    test::write_sqlite(folder / ("drive_" + std::to_string(i * 5) + ".db3"), {all[static_cast<std::size_t>(i)]});
  const Read read = read_all(folder.path());
  EXPECT_EQ(read.end, ErrorCode::EndOfData);
  expect_sample(read);
}

TEST(Bag, AMessageThatWasCompressedAloneIsUnpacked) {
  const test::TemporaryFolder folder;
  auto packed = sample();
  for (SampleMessage& m : packed) {
    std::string out(ZSTD_compressBound(m.bytes.size()), '\0');
    out.resize(ZSTD_compress(out.data(), out.size(), m.bytes.data(), m.bytes.size(), 1));
    m.bytes = out;
  }
  test::write_sqlite(folder / "packed.db3", packed);
  expect_sample(read_all(folder / "packed.db3"));
  test::write_mcap(folder / "packed.mcap", packed, storage::Compression::None);
  expect_sample(read_all(folder / "packed.mcap"));
}

TEST(Bag, ReadsAPackedFileOfAFolderWhereItIsUnpacked) {
  const test::TemporaryFolder folder;
  test::write_mcap(folder / "drive_0.mcap", sample(), storage::Compression::None);
  test::write_file(folder / "drive_0.mcap.zstd", "\x28\xB5\x2F\xFD and more bytes");
  const Read read = read_all(folder.path());
  EXPECT_EQ(read.end, ErrorCode::EndOfData);
  expect_sample(read);
}

TEST(Bag, AFileThatIsPackedAsAWholeIsUnpacked) {
  const test::TemporaryFolder folder;
  const auto packed = [](const std::string& plain) {
    std::string out(ZSTD_compressBound(plain.size()), '\0');
    out.resize(ZSTD_compress(out.data(), out.size(), plain.data(), plain.size(), 1));
    return out;
  };
  const auto all = sample();
  test::write_sqlite(folder / "one.db3", all);
  // Two frames, one behind the other, are one file.
  const std::string plain = test::contents(folder / "one.db3");
  const std::string both = packed(plain.substr(0, 5000)) + packed(plain.substr(5000));
  test::write_file(folder / "one.db3.zstd", both);
  const auto one = rosbag::unpacked_recording(folder / "one.db3.zstd", folder / "unpacked");
  ASSERT_TRUE(one.ok()) << one.error().message;
  EXPECT_EQ(one->filename(), "one.db3");
  EXPECT_EQ(test::contents(*one), plain);
  expect_sample(read_all(*one));

  test::write_file(folder / "cut.db3.zstd", both.substr(0, both.size() - 9));
  const auto cut = rosbag::unpacked_recording(folder / "cut.db3.zstd", folder / "unpacked");
  ASSERT_FALSE(cut.ok());
  EXPECT_EQ(cut.error().code, ErrorCode::Truncated);
  test::write_file(folder / "bad.bag.zst", both.substr(0, 5) + std::string(100, '\7'));
  EXPECT_EQ(rosbag::unpacked_recording(folder / "bad.bag.zst", folder / "unpacked").error().code, ErrorCode::Malformed);

  // Of a folder the second file is packed. What is not packed stays where it is.
  std::filesystem::create_directory(folder / "drive");
  test::write_mcap(folder / "drive/d_0.mcap", {all.begin(), all.begin() + 3}, storage::Compression::None);
  EXPECT_EQ(*rosbag::unpacked_recording(folder / "drive", folder / "parts"), folder / "drive");
  test::write_mcap(folder / "d_1.mcap", {all.begin() + 3, all.end()}, storage::Compression::None);
  test::write_file(folder / "drive/d_1.mcap.zstd", packed(test::contents(folder / "d_1.mcap")));
  const auto parts = rosbag::unpacked_recording(folder / "drive", folder / "parts");
  ASSERT_TRUE(parts.ok()) << parts.error().message;
  expect_sample(read_all(*parts));
}

TEST(Bag, TheFilesIntoWhichRos1SplitARecordingAreOne) {
  const test::TemporaryFolder folder;
  const auto all = sample();
  const auto as_it_is = [](const std::string& s) { return s; };
  for (int i = 0; i < 7; ++i) {
    const std::string name =
        "drive_2024-05-01-10-0" + std::to_string(i) + "-00_" + std::to_string(i) + (i < 6 ? ".bag" : ".bag.active");
    test::write_file(folder / name, test::ros1_bag({all[static_cast<std::size_t>(i)]}, "none", as_it_is));
  }
  EXPECT_TRUE(rosbag::is_bag(folder.path()));
  expect_sample(read_all(folder.path()));
  // Two recordings of a day are not one.
  test::write_file(folder / "other_2024-05-01-12-00-00_0.bag", test::ros1_bag(all, "none", as_it_is));
  const auto both = rosbag::open_bag(folder.path());
  ASSERT_FALSE(both.ok());
  EXPECT_NE(both.error().message.find("has several recordings of ROS 1: name one of them"), std::string::npos);
  EXPECT_FALSE(rosbag::is_bag(folder.path()));
}

TEST(Bag, MessagesAreSortedByTheRecordersTimes) {
  const test::TemporaryFolder folder;
  const auto all = sample();
  std::vector<SampleMessage> turned(all.rbegin(), all.rend());
  test::write_sqlite(folder / "turned.db3", turned);
  auto bag = rosbag::open_bag(folder / "turned.db3");
  ASSERT_TRUE(bag.ok());
  using Time = std::optional<UnixTime>;
  const auto time_of = [&](const rosbag::BagTopic& topic, const rosbag::BagMessage& message) {
    return topic.name == all[0].topic ? Time() : Time(message.received);
  };
  const auto sorted = rosbag::in_order(**bag, folder / "copy", time_of);
  ASSERT_TRUE(sorted.ok()) << sorted.error().message;
  std::size_t given = 0;
  for (const SampleMessage& wanted : all) {
    if (wanted.topic == all[0].topic) continue;
    const auto message = (*sorted)->next();
    ASSERT_TRUE(message.ok()) << message.error().message;
    EXPECT_EQ(count_ns(message->received), wanted.time_ns);
    EXPECT_EQ((*sorted)->topics().at(message->topic).name, wanted.topic);
    EXPECT_TRUE(std::ranges::equal(message->data.bytes(), storage::as_bytes(wanted.bytes)));
    ++given;
  }
  EXPECT_GT(given, 1u);
  for (int i = 0; i < 2; ++i) EXPECT_EQ((*sorted)->next().error().code, ErrorCode::EndOfData);
}

TEST(Bag, WhatIsSortedTellsItsDamage) {
  const test::TemporaryFolder folder;
  auto packed = sample();
  packed[1].bytes = "\x28\xB5\x2F\xFD broken";
  test::write_sqlite(folder / "damaged.db3", packed);
  auto bag = rosbag::open_bag(folder / "damaged.db3");
  ASSERT_TRUE(bag.ok());
  const auto sorted = rosbag::in_order(
      **bag, folder / "copy", [](const auto&, const auto& message) { return std::optional(message.received); });
  ASSERT_TRUE(sorted.ok()) << sorted.error().message;
  EXPECT_EQ((*sorted)->next().error().code, ErrorCode::Malformed);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_TRUE((*sorted)->next().ok());
  EXPECT_EQ((*sorted)->next().error().code, ErrorCode::EndOfData);
}

TEST(Bag, ACutFileGivesWhatIsWholeAndSaysSo) {
  const test::TemporaryFolder folder;
  const auto all = sample();
  for (const auto& path : write_all(folder)) {
    const std::string bytes = test::contents(path);
    for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 150) {
      SCOPED_TRACE(path.string() + " cut to " + std::to_string(size));
      test::write_file(folder / "cut", bytes.substr(0, size));
      const Read read = read_all(folder / "cut");
      ASSERT_LE(read.messages.size(), all.size());
      for (std::size_t i = 0; i < read.messages.size(); ++i) EXPECT_TRUE(same(read.messages[i], all[i]));
      // An MCAP file has a summary behind its messages, and .bag may end behind any record.
      if (read.messages.size() < all.size() && path.extension() != ".bag") {
        EXPECT_TRUE(read.end != ErrorCode::EndOfData || read.damages > 0);
      }
    }
  }
}

TEST(Bag, FilesOfOtherKindsAreRefusedWithTheReason) {
  const test::TemporaryFolder folder;
  test::write_file(folder / "text.db3", "not a database");
  test::write_file(folder / "old.bag", "#ROSBAG V1.2\n and more bytes");
  test::write_file(folder / "older.bag", "#ROSRECORD V1.2\n and more bytes");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "other.db3").c_str(), &database), SQLITE_OK);
  sqlite3_exec(database, "CREATE TABLE topics(id INTEGER); CREATE VIEW messages AS SELECT 1", nullptr, nullptr,
               nullptr);
  sqlite3_close(database);
  test::write_mcap(folder / "json.mcap", sample(), storage::Compression::None, "json");
  for (const char* name : {"text.db3", "old.bag", "older.bag", "other.db3"}) {
    const auto bag = open_bag(folder / name);
    ASSERT_FALSE(bag.ok()) << name;
    EXPECT_EQ(bag.error().code, ErrorCode::Unsupported) << bag.error().message;
  }
  for (const char* name : {"old.bag", "older.bag"}) {
    EXPECT_TRUE(rosbag::is_bag(folder / name)) << "no command may take it for another kind of file";
    EXPECT_NE(open_bag(folder / name).error().message.find("rosbag fix"), std::string::npos);
  }
  EXPECT_TRUE(rosbag::is_bag(folder / "json.mcap")) << "who reads it says that its messages are not of ROS";
  EXPECT_FALSE(rosbag::is_bag(folder / "text.db3"));
  std::filesystem::create_directory(folder / "empty");
  EXPECT_FALSE(open_bag(folder / "empty").ok());
}

/// The packets of a scan as each driver publishes them.
struct Layout {
  const char* type;
  RosEncoding encoding;
};
std::string scan_of(const Layout& layout, const std::vector<std::string>& packets) {
  test::RosWriter out(layout.encoding);
  const std::string type = layout.type;
  if (type == "ouster_ros/PacketMsg") return out.sequence(packets[0]).bytes();
  if (type == "rslidar_msg/RslidarPacket")
    return out.header(kBegin_ns, "laser").raw(std::string("\0\1", 2)).sequence(packets[0]).bytes();
  out.header(kBegin_ns, "laser").put(static_cast<std::uint32_t>(packets.size()));
  for (std::size_t i = 0; i < packets.size(); ++i) {
    if (type == "rslidar_msg/RslidarScan") {
      out.header(kBegin_ns, "laser").raw(std::string("\0\1", 2)).sequence(packets[i]);
      continue;
    }
    out.time(kBegin_ns + static_cast<std::int64_t>(i) * 1'000'000);
    if (type == "rslidar_msgs/rslidarScan") out.raw(packets[i] + std::string(1248 - packets[i].size(), '\0'));
    if (type == "hesai_ros_driver/UdpFrame")
      out.sequence(packets[i]).put(static_cast<std::uint32_t>(packets[i].size()));
    if (type == "velodyne_msgs/VelodyneScan") out.raw(packets[i]);
    if (type == "nebula_msgs/NebulaPackets") out.sequence(packets[i]);
    if (type.ends_with("/PandarScan"))
      out.raw(packets[i] + std::string(1500 - packets[i].size(), '\0'))
          .put(static_cast<std::uint32_t>(packets[i].size()));
  }
  return out.bytes();
}

TEST(ScannerFiles, HoldTheDatagramsOfEveryKindOfMessage) {
  std::vector<std::string> packets;
  for (const char c : {'a', 'b', 'c'}) packets.push_back(std::string(1206, c));
  for (const Layout& layout :
       {Layout{"velodyne_msgs/VelodyneScan", RosEncoding::Cdr}, Layout{"velodyne_msgs/VelodyneScan", RosEncoding::Ros1},
        Layout{"pandar_msgs/PandarScan", RosEncoding::Cdr}, Layout{"pandar_msgs/PandarScan", RosEncoding::Ros1},
        Layout{"hesai_lidar/PandarScan", RosEncoding::Cdr}, Layout{"hesai_lidar/PandarScan", RosEncoding::Ros1},
        Layout{"nebula_msgs/NebulaPackets", RosEncoding::Cdr}, Layout{"ouster_ros/PacketMsg", RosEncoding::Cdr},
        Layout{"hesai_ros_driver/UdpFrame", RosEncoding::Cdr}, Layout{"hesai_ros_driver/UdpFrame", RosEncoding::Ros1},
        Layout{"rslidar_msg/RslidarPacket", RosEncoding::Cdr}, Layout{"rslidar_msg/RslidarPacket", RosEncoding::Ros1},
        Layout{"rslidar_msg/RslidarScan", RosEncoding::Cdr}, Layout{"rslidar_msgs/rslidarScan", RosEncoding::Ros1}}) {
    SCOPED_TRACE(std::string(layout.type) + name(layout.encoding));
    const test::TemporaryFolder folder;
    const std::vector<SampleMessage> messages{
        {"/Front Laser/packets", layout.type, kBegin_ns, scan_of(layout, packets)}};
    const auto bag = folder / (layout.encoding == RosEncoding::Cdr ? "a.db3" : "a.bag");
    if (layout.encoding == RosEncoding::Cdr)
      test::write_sqlite(bag, messages);
    else
      test::write_file(bag, test::ros1_bag(messages, "none", [](const std::string& s) { return s; }));
    const auto files = rosbag::write_scanner_files(bag, folder.path());
    ASSERT_TRUE(files.ok()) << files.error().message;
    ASSERT_EQ(files->topics.size(), 1u);
    EXPECT_EQ(files->topics[0].file, folder / "front_laser_packets.pcap");
    EXPECT_EQ(files->topics[0].broken, 0u);
    drivers::PcapSource source({.path = files->topics[0].file.string(), .ports = {}, .source_address = {}});
    ASSERT_TRUE(source.open().ok());
    const std::string type = layout.type;
    const std::size_t expected = type == "ouster_ros/PacketMsg" || type == "rslidar_msg/RslidarPacket" ? 1 : 3;
    for (std::size_t i = 0; i < expected; ++i) {
      const auto packet = source.next({});
      ASSERT_TRUE(packet.ok()) << packet.error().message;
      const auto bytes = packet->bytes.bytes();
      EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 1206)),
                packets[i]);
      const bool has_no_stamp = type == "rslidar_msg/RslidarScan";
      EXPECT_EQ(count_ns(packet->received), kBegin_ns + (has_no_stamp ? 0 : static_cast<std::int64_t>(i) * 1'000'000));
    }
    EXPECT_EQ(source.next({}).error().code, ErrorCode::EndOfData);
  }
}

TEST(ScannerFiles, CountBrokenMessagesAndWriteMetadata) {
  const test::TemporaryFolder folder;
  const std::string scan = scan_of({"velodyne_msgs/VelodyneScan", RosEncoding::Cdr}, {std::string(1206, 'a')});
  test::RosWriter many(RosEncoding::Cdr);  // claims more packets than the message has bytes
  many.header(kBegin_ns, "laser").put(std::uint32_t{0xFFFFFFFF});
  const std::string metadata = test::RosWriter(RosEncoding::Cdr).text(R"({"sensor_info": {}})").bytes();
  test::write_sqlite(folder / "a.db3",
                     {{"/v", "velodyne_msgs/VelodyneScan", kBegin_ns, scan},
                      {"/v", "velodyne_msgs/VelodyneScan", kBegin_ns, scan.substr(0, scan.size() - 1)},
                      {"/v", "velodyne_msgs/VelodyneScan", kBegin_ns, many.bytes()},
                      {"/v", "velodyne_msgs/VelodyneScan", kBegin_ns, ""},
                      {"/ouster/metadata", "std_msgs/String", kBegin_ns, metadata},
                      {"/chatter", "std_msgs/String", kBegin_ns, data_of(1)}});
  const auto files = rosbag::write_scanner_files(folder / "a.db3", folder.path());
  ASSERT_TRUE(files.ok()) << files.error().message;
  ASSERT_EQ(files->topics.size(), 3u);
  EXPECT_EQ(files->topics[0].messages, 4u);
  EXPECT_EQ(files->topics[0].broken, 3u);
  EXPECT_EQ(files->topics[0].packets, 1u);
  EXPECT_EQ(test::contents(files->topics[1].file), R"({"sensor_info": {}})");
  EXPECT_TRUE(files->topics[2].file.empty());
}

TEST(RosMessage, ReadsBothByteOrdersAndAlignsFields) {
  // A byte, then a double that CDR aligns to eight bytes behind the head.
  std::string little("\x00\x01\x00\x00\x2A", 5), big("\x00\x00\x00\x00\x2A", 5), second("\x00\x07\x00\x00\x2A", 5);
  const double value = -1.5;
  std::string bytes(reinterpret_cast<const char*>(&value), 8);
  little += std::string(7, '\0') + bytes;
  second += std::string(3, '\0') + bytes;
  big += std::string(7, '\0') + std::string(bytes.rbegin(), bytes.rend());
  for (const std::string& message : {little, big, second}) {
    drivers::RosReader in(std::as_bytes(std::span(message)), RosEncoding::Cdr);
    EXPECT_EQ(in.take<std::uint8_t>(), 42);
    EXPECT_EQ(in.take<double>(), value);
    EXPECT_TRUE(in.ok());
    in.take<std::uint8_t>();
    EXPECT_FALSE(in.ok());
  }
}

}  // namespace
}  // namespace hueline
