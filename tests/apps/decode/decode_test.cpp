// Clouds of the scanners in a capture file: of a made-up scanner, and of real ones.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "apps/decode/decode_bag.hpp"
#include "apps/decode/decode_capture.hpp"
#include "core/calendar.hpp"
#include "storage/las_reader.hpp"
#include "storage/pcd_reader.hpp"
#include "tests/apps/captures.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/rosbag/cloud_message.hpp"
#include "tests/rosbag/sample_bag.hpp"
#include "tests/runtime/toy_scanner/toy_scanner.hpp"
#include "tests/support/pcap_writer.hpp"
#include "tests/support/test_data.hpp"

namespace hueline {
namespace {

using apps::decode_capture;
using apps::DecodeOptions;
using test::TemporaryFile;

constexpr std::int64_t kTime_s = 1'700'000'000;

std::vector<const drivers::DeviceType*> types() {
  std::vector<const drivers::DeviceType*> all(drivers::device_types().begin(), drivers::device_types().end());
  all.push_back(&toy::kToyScanner);
  return all;
}

std::string toy_data() {
  const std::array<std::array<float, 3>, 2> seen{{{0, 10, 0}, {5, 10, 1}}};
  const auto sent = toy::encode('D', from_gps_week(2300, std::chrono::seconds(100'000)), seen);
  return {reinterpret_cast<const char*>(sent.data()), sent.size()};
}

/// A capture of these payloads, each sent to its port.
test::Bytes capture(const std::vector<std::pair<std::string, unsigned>>& sent) {
  test::PcapWriter pcap;
  for (const auto& [payload, port] : sent)
    pcap.frame(kTime_s * 1'000'000'000, test::ethernet_frame(test::ipv4_packet(test::udp_segment(payload, port))));
  return pcap.bytes();
}

DecodeOptions decoding(const TemporaryFile& file, const TemporaryFile& out) {
  DecodeOptions options;
  options.capture = file.path();
  options.out = out.path();
  return options;
}

TEST(Decode, WritesThePointsOfAScannerWithTheirTimes) {
  const auto known = types();
  const TemporaryFile file("decode.pcap", capture({{toy_data(), 5000}, {"noise", 5000}, {toy_data(), 5000}}));
  const TemporaryFile pcd("decode.pcd", {}), las("decode.las", {});
  const auto decoded = decode_capture(decoding(file, pcd), known);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->scanners.size(), 1u);
  EXPECT_EQ(decoded->scanners[0].points, 4u);
  const auto cloud = storage::read_pcd(pcd.path());
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  ASSERT_EQ(cloud->points(), 4u);
  EXPECT_EQ(cloud->column("x")[1], 5);
  EXPECT_EQ(cloud->column("z")[3], 1);
  EXPECT_EQ(cloud->column("return_count")[3], 1);
  // Viewers find the line of counts by "count " in any letters.
  std::ifstream file_of_cloud(pcd.path(), std::ios::binary);
  std::string head(std::istreambuf_iterator<char>(file_of_cloud), {});
  std::transform(head.begin(), head.end(), head.begin(),
                 [](char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c); });
  EXPECT_EQ(head.find("count "), head.find("\ncount 1 1") + 1);
  const GpsTime fired = from_gps_week(2300, std::chrono::seconds(100'000));
  EXPECT_EQ(cloud->column("time")[0], to_seconds(to_unix(fired).time_since_epoch()));

  ASSERT_TRUE(decode_capture(decoding(file, las), known).ok());
  auto reader = storage::LasReader::open(las.path());
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  std::vector<storage::LasPoint> points;
  ASSERT_TRUE(reader->next(points).ok());
  ASSERT_EQ(points.size(), 4u);
  EXPECT_NEAR(points[1].x, 5, 1e-9);
  EXPECT_EQ(reader->gps_time(points[0]), fired);
}

TEST(Decode, GivesEachScannerACloudOfItsOwn) {
  const auto known = types();
  const TemporaryFile file("decode_two.pcap", capture({{toy_data(), 5000}, {toy_data(), 5001}, {toy_data(), 5001}}));
  const TemporaryFile out("decode_two.pcd", {});
  const auto decoded = decode_capture(decoding(file, out), known);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->scanners.size(), 2u);
  EXPECT_EQ(decoded->scanners[0].points, 2u);
  EXPECT_EQ(decoded->scanners[1].points, 4u);
  for (const auto& scanner : decoded->scanners) {
    EXPECT_EQ(storage::read_pcd(scanner.cloud.string())->points(), scanner.points);
    std::filesystem::remove(scanner.cloud);
  }
}

TEST(Decode, TellsAScannerThatItDoesNotKnow) {
  const TemporaryFile file("decode_unknown.pcap", capture({{toy_data(), 5000}}));
  const TemporaryFile out("decode_unknown.las", {});
  const auto alone = decode_capture(decoding(file, out));
  ASSERT_FALSE(alone.ok());
  EXPECT_EQ(alone.error().code, ErrorCode::Unsupported);
  EXPECT_NE(alone.error().message.find("not supported"), std::string::npos) << alone.error().message;
  const std::string held =
      fmt::format("It holds 1 packet of {} bytes on average from 192.168.1.201", toy_data().size());
  EXPECT_NE(alone.error().message.find(held), std::string::npos) << alone.error().message;

  // Beside one that is known, it is told too.
  std::vector<std::pair<std::string, unsigned>> sent{{toy_data(), 5000}};
  for (int i = 0; i < 30; ++i) sent.emplace_back(std::string(900, 'x'), 6000);
  const TemporaryFile mixed("decode_mixed.pcap", capture(sent));
  const auto known = types();
  const auto decoded = decode_capture(decoding(mixed, out), known);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->not_supported.size(), 1u);
  EXPECT_NE(decoded->not_supported[0].find("port 6000"), std::string::npos) << decoded->not_supported[0];
}

/// As after tcpdump -s 600: nothing is known of it, and the reason is not the device.
TEST(Decode, ACaptureThatKeptOnlyTheBeginningsOfFramesSaysSo) {
  test::PcapWriter pcap;
  const auto frame = test::ethernet_frame(test::ipv4_packet(test::udp_segment(toy_data(), 5000)));
  for (int i = 0; i < 3; ++i) pcap.frame(kTime_s * 1'000'000'000, frame, frame.size() - 5);
  const TemporaryFile file("decode_short.pcap", pcap.bytes()), out("decode_short.las", {});
  const auto known = types();
  const auto decoded = decode_capture(decoding(file, out), known);
  ASSERT_FALSE(decoded.ok());
  EXPECT_NE(decoded.error().message.find("frames not delivered: 3 cut off by the capture"), std::string::npos)
      << decoded.error().message;
  EXPECT_EQ(decoded.error().message.find("0 with broken headers"), std::string::npos);
}

/// The toy scanner has none. Of two files of angles, that which fits the scanner is used.
TEST(Decode, SaysWhichDescriptionsWereUsed) {
  HUELINE_REQUIRE_DATA("hesai/xt32_scans.pcap");
  const TemporaryFile out("decode_described.las", {});
  DecodeOptions options;
  options.capture = data_file.string();
  options.out = out.path();
  const std::string fits = (test::data_dir() / "hesai/PandarXT32.csv").string(),
                    other = (test::data_dir() / "hesai/Pandar40P.csv").string();
  options.descriptions = {other, fits};
  const auto decoded = decode_capture(options);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->used_descriptions, std::set<std::string>{fits});
  EXPECT_NE(decoded->refused_descriptions.at(other).find("it has 40 channels, the model 32"), std::string::npos);
}

/// A topic of a scanner's IMU holds packets, too.
TEST(Decode, TheOneCloudOfARecordingHasTheNameThatWasAskedFor) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_scans.pcap");
  std::vector<test::SampleMessage> messages;
  const auto add = [&](const std::string& topic, const std::string& bytes) {
    const std::int64_t time = kTime_s * 1'000'000'000 + static_cast<std::int64_t>(messages.size()) * 1'000'000;
    messages.push_back(
        {topic, "ouster_ros/PacketMsg", time, test::RosWriter(drivers::RosEncoding::Cdr).sequence(bytes).bytes()});
  };
  for (const test::Datagram& datagram : test::datagrams_of(data_file)) {
    add("/os/points", datagram.payload);
    add("/os/imu", std::string(48, 'i'));
  }
  const TemporaryFile file("decode_topics.db3", {}), out("decode_topics.pcd", {});
  test::write_sqlite(file.path(), messages);
  const auto decoded = apps::decode_bag(decoding(file, out));
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->decoded.scanners.size(), 1u);
  EXPECT_EQ(decoded->decoded.scanners[0].cloud, out.path());
  EXPECT_EQ(storage::read_pcd(out.path())->points(), decoded->decoded.scanners[0].points);
  const std::string why = decoded->unused.at("/os/imu");
  EXPECT_NE(why.find("603 packets of 48 bytes"), std::string::npos) << why;
  EXPECT_EQ(why.find("TCP"), std::string::npos) << why;
}

TEST(Decode, TopicsOfScannersThatAreNotSupportedAreToldBesideOthers) {
  constexpr std::int64_t kBegin_ns = kTime_s * 1'000'000'000;
  std::string packet(1206, '\0');
  for (std::size_t block = 0; block < 12; ++block) packet.replace(block * 100, 2, "\xff\xee");
  packet.replace(1204, 2, "\x37\x10");  // a product that Velodyne does not have
  std::vector<test::SampleMessage> messages{
      {"/points", "sensor_msgs/PointCloud2", kBegin_ns,
       test::velodyne_turn(kBegin_ns, 100, 0.1).bytes(drivers::RosEncoding::Cdr)},
      {"/front", "seyond/SeyondScan", kBegin_ns, std::string("\0\1\0\0", 4) + std::string(100, 'x')}};
  for (int i = 0; i < 30; ++i)
    messages.push_back({"/rear", "ouster_ros/PacketMsg", kBegin_ns + i,
                        test::RosWriter(drivers::RosEncoding::Cdr).sequence(packet).bytes()});
  const TemporaryFile file("decode_unknown.db3", {}), out("decode_unknown.pcd", {});
  test::write_sqlite(file.path(), messages);
  const auto decoded = apps::decode_bag(decoding(file, out));
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->decoded.scanners.size(), 1u);
  EXPECT_EQ(decoded->decoded.scanners[0].points, 100u);
  ASSERT_EQ(decoded->decoded.not_supported.size(), 2u);
  EXPECT_EQ(decoded->decoded.not_supported[0], "/front: the scanner of seyond/SeyondScan");
  EXPECT_TRUE(
      decoded->decoded.not_supported[1].starts_with("/rear: of no scanner that is known: a Velodyne of product 0x10"));
  EXPECT_EQ(decoded->unused.at("/front"), "packets of a scanner that is not supported");
}

TEST(Decode, ACutFileGivesWhatIsWholeAndSaysSo) {
  test::Bytes bytes = capture({{toy_data(), 5000}, {toy_data(), 5000}});
  bytes.resize(bytes.size() - 3);
  const TemporaryFile file("decode_cut.pcap", bytes), out("decode_cut.pcd", {});
  const auto known = types();
  const auto decoded = decode_capture(decoding(file, out), known);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->scanners.at(0).points, 2u);
  EXPECT_FALSE(decoded->trouble.ok());
}

/// A VLP-16 whose receiver has a fix and no pulse. `minute` is that of its sentences; its counter says minute 16.
test::Bytes capture_without_pulse(int minute, bool is_active, bool has_data = true) {
  std::vector<std::pair<std::string, unsigned>> sent;
  const auto text = [](const test::Bytes& bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const std::uint32_t begin_us = (16 * 60 + 40) * 1'000'000u + 100'000;
  test::VelodyneBlocksOfPacket blocks{};
  for (unsigned b = 0; b < 12; ++b) {
    blocks[b].azimuth = 40 * b;
    blocks[b].shots[0].distance = 5000;
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::string rmc =
        fmt::format("GPRMC,08{:02}40,{},3650.0,N,00224.0,W,0,0,210116,,,A", minute, is_active ? 'A' : 'V');
    sent.emplace_back(text(test::velodyne_position(begin_us + 1327 * i, 0, test::nmea_sentence(rmc))), 8308);
    if (has_data) sent.emplace_back(text(test::velodyne_data(blocks, begin_us + 1327 * i, 0x37, 0x22)), 2368);
  }
  return capture(sent);
}

TEST(Decode, ValidSentencesNameTheHourWithoutAPulse) {
  const TemporaryFile out("decode_hour.las", {});
  const auto begin_of = [&](const test::Bytes& bytes) {
    const TemporaryFile file("decode_hour.pcap", bytes);
    const auto decoded = decode_capture(decoding(file, out));
    EXPECT_TRUE(decoded.ok()) << decoded.error().message;
    const auto& scanner = decoded->scanners.at(0);
    if (scanner.begin) {
      EXPECT_NE(scanner.clock.find("without a pulse"), std::string::npos) << scanner.clock;
    }
    return scanner.begin ? iso_utc(*scanner.begin) : std::string();
  };
  EXPECT_EQ(begin_of(capture_without_pulse(16, true)), "2016-01-21T08:16:40.100Z");
  EXPECT_EQ(begin_of(capture_without_pulse(16, false)), "") << "a receiver without a fix may name any hour";
  EXPECT_EQ(begin_of(capture_without_pulse(17, true)), "") << "the counter says another minute";
}

TEST(Decode, PositionPacketsAloneAreNamed) {
  const TemporaryFile file("decode_lone.pcap", capture_without_pulse(16, true, false)), out("decode_lone.las", {});
  const auto decoded = decode_capture(decoding(file, out));
  ASSERT_FALSE(decoded.ok());
  EXPECT_NE(decoded.error().message.find("3 position packets of a Velodyne"), std::string::npos)
      << decoded.error().message;
}

/// What one Velodyne sends, as its card and port say it.
struct Sent {
  unsigned port, product;
  std::uint32_t period_us;
  std::byte card;
  unsigned mode = 0x37, second_flag = 0xEEFF, first_flag = 0xEEFF;
};

/// A capture of Velodynes at one address, 40 packets of each.
test::Bytes capture_of(const std::vector<Sent>& scanners) {
  std::multimap<std::int64_t, test::Bytes> frames;  // by time
  for (const Sent& one : scanners)
    for (unsigned i = 0; i < 40; ++i) {
      auto blocks = test::turning(i * 480 % 36000, 40);
      for (std::size_t b = 0; b < blocks.size(); ++b) blocks[b].flag = b % 2 == 0 ? one.first_flag : one.second_flag;
      const auto data = test::velodyne_data(blocks, 1000 + i * one.period_us, one.mode, one.product);
      const std::string text(reinterpret_cast<const char*>(data.data()), data.size());
      auto frame = test::ethernet_frame(test::ipv4_packet(test::udp_segment(text, one.port)));
      frame[11] = one.card;
      frames.emplace(kTime_s * 1'000'000'000 + std::int64_t{i} * one.period_us * 1000, std::move(frame));
    }
  test::PcapWriter pcap;
  for (const auto& [time, frame] : frames) pcap.frame(time, frame);
  return pcap.bytes();
}

/// Returns the number of points of each scanner, by its name, and removes their clouds.
std::multimap<std::string, std::uint64_t> points_by_name(const test::Bytes& capture) {
  const TemporaryFile file("decode_scanners.pcap", capture), out("decode_scanners.las", {});
  const auto decoded = decode_capture(decoding(file, out));
  EXPECT_TRUE(decoded.ok()) << decoded.error().message;
  std::multimap<std::string, std::uint64_t> found;
  if (!decoded.ok()) return found;
  for (const auto& scanner : decoded->scanners) {
    found.emplace(scanner.name, scanner.points);
    if (decoded->scanners.size() > 1) std::filesystem::remove(scanner.cloud);
  }
  return found;
}

/// Scanners come from the maker with one address, and a computer may have recorded them at two of its ports.
TEST(Decode, ScannersWithOneAddressAreToldApartByTheirNetworkCards) {
  constexpr std::byte kOne{1}, kOther{2};
  EXPECT_EQ(points_by_name(capture_of({{2368, 0x22, 1327, kOne}, {2368, 0x22, 1327, kOther}})),
            (std::multimap<std::string, std::uint64_t>{{"velodyne VLP-16", 15360}, {"velodyne VLP-16", 15360}}));
}

/// As in a capture of a computer that played two recordings.
TEST(Decode, TheTimingOfAVelodyneIsNotThatOfAnotherAtItsAddress) {
  constexpr std::byte kOne{1};
  EXPECT_EQ(points_by_name(capture_of({{2368, 0x22, 1327, kOne}, {2369, 0x21, 553, kOne}})),
            (std::multimap<std::string, std::uint64_t>{{"velodyne HDL-32E", 15360}, {"velodyne VLP-16", 15360}}));
}

/// To one port, from one computer: the second is told, and the first has its own packets alone.
TEST(Decode, APacketOfAnotherVelodyneIsNotDecodedByItsTiming) {
  constexpr std::byte kOne{1};
  const TemporaryFile file("decode_port.pcap", capture_of({{2368, 0x22, 1327, kOne}, {2368, 0x21, 553, kOne}}));
  const TemporaryFile out("decode_port.las", {});
  const auto decoded = decode_capture(decoding(file, out));
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->scanners.size(), 1u);
  EXPECT_EQ(decoded->scanners[0].name, "velodyne VLP-16");
  EXPECT_EQ(decoded->scanners[0].points, 15360u);
  EXPECT_EQ(decoded->scanners[0].faults.at("WrongDevice"), 40u);
}

TEST(Decode, AScannerThatGivesNoPointIsToldBesideOneThatDoes) {
  constexpr std::byte kOne{1};
  EXPECT_EQ(points_by_name(capture_of({{2368, 0x22, 1327, kOne}, {2370, 0x28, 664, kOne, 0x37, 0x1234, 0x1234}})),
            (std::multimap<std::string, std::uint64_t>{{"velodyne VLP-16", 15360}, {"velodyne VLP-32C", 0}}));
}

TEST(Decode, AVelodyneInAnotherReturnModeIsToldBesideOneOfItsAddress) {
  constexpr std::byte kOne{1};
  const TemporaryFile file("decode_mode.pcap", capture_of({{2368, 0x22, 1327, kOne}, {2370, 0x28, 664, kOne, 0x3B}}));
  const TemporaryFile out("decode_mode.las", {});
  const auto decoded = decode_capture(decoding(file, out));
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->scanners.size(), 1u);
  EXPECT_EQ(decoded->scanners[0].points, 15360u);
  ASSERT_EQ(decoded->not_supported.size(), 1u);
  EXPECT_NE(decoded->not_supported[0].find("a Velodyne VLP-32C in return mode 0x3B"), std::string::npos)
      << decoded->not_supported[0];
}

/// Where others have the factory byte, an HDL-64E has its status, which may be any model's byte.
TEST(Decode, AnHdl64eIsNotSupported) {
  const TemporaryFile file("decode_64.pcap", capture_of({{2368, 0x28, 288, std::byte{1}, 0x37, 0xDDFF}}));
  const TemporaryFile out("decode_64.las", {});
  const auto decoded = decode_capture(decoding(file, out));
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().code, ErrorCode::Unsupported);
  EXPECT_NE(decoded.error().message.find("a Velodyne of product HDL-64E"), std::string::npos)
      << decoded.error().message;
}

TEST(Decode, TheHourOfAVelodyneComesFromItsReceiverOrTheUser) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_gps.pcap");
  const TemporaryFile out("decode_gps.las", {});
  DecodeOptions options;
  options.capture = data_file.string();
  options.out = out.path();
  const auto labelled = decode_capture(options);
  ASSERT_TRUE(labelled.ok()) << labelled.error().message;
  ASSERT_TRUE(labelled->scanners.at(0).begin);
  EXPECT_EQ(iso_utc(*labelled->scanners[0].begin), "2016-01-21T08:18:02.340Z");

  options.capture = (test::data_dir() / "velodyne/vlp16_scans.pcap").string();
  const auto unlabelled = decode_capture(options);
  ASSERT_TRUE(unlabelled.ok());
  EXPECT_FALSE(unlabelled->scanners.at(0).begin) << "nothing in the file names the hour";
  options.near = from_utc({.year = 2023, .month = 1, .day = 11, .hour = 1, .minute = 10});
  const auto told = decode_capture(options);
  ASSERT_TRUE(told.ok());
  EXPECT_EQ(iso_utc(told->scanners.at(0).begin.value()), "2023-01-11T01:02:20.554Z");
}

}  // namespace
}  // namespace hueline
