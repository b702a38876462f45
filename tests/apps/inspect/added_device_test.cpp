// Adds a kind of device that the program does not have, by a folder (tests/runtime/toy_scanner) and one line (types()).
// `inspect` then recognises its files.
#include <gtest/gtest.h>

#include "apps/inspect/inspect.hpp"
#include "core/calendar.hpp"
#include "tests/runtime/toy_scanner/toy_scanner.hpp"
#include "tests/support/pcap_writer.hpp"

namespace hueline {
namespace {

using apps::inspect_file;
using test::TemporaryFile;

std::vector<const drivers::DeviceType*> types() {
  std::vector<const drivers::DeviceType*> all(drivers::device_types().begin(), drivers::device_types().end());
  all.push_back(&toy::kToyScanner);
  return all;
}

std::vector<std::byte> data() {
  const std::array<std::array<float, 3>, 3> seen{{{0, 10, 0}, {5, 10, 0}, {0, 0.25F, 0}}};
  return toy::encode('D', from_gps_week(2300, std::chrono::seconds(100'000)), seen);
}

test::Bytes capture() {
  const auto sent = data();
  const std::string payload(reinterpret_cast<const char*>(sent.data()), sent.size());
  test::PcapWriter pcap;
  for (const std::string& one : {std::string("noise"), payload, payload, std::string("noise")})
    pcap.frame(1'000'000'000, test::ethernet_frame(test::ipv4_packet(test::udp_segment(one, 5000))));
  return pcap.bytes();
}

TEST(InspectOfAnAddedDevice, ReadsItsLogs) {
  const auto known = types();
  for (const char* name : {"inspected.toy", "inspected.bin"}) {
    const TemporaryFile file(name, data());
    const auto seen = inspect_file(file.path(), known);
    ASSERT_TRUE(seen.trouble.ok()) << seen.trouble.error().message;
    EXPECT_EQ(seen.found->at("format"), "toy scanner");
    EXPECT_EQ(seen.found->at("laser_returns"), 2) << "the third is nearer than the keys of a device allow by default";
    EXPECT_EQ(seen.found->at("bytes_unaccounted"), 0);
  }
  const TemporaryFile file("inspected.toy", data());
  const auto unknown = inspect_file(file.path());
  ASSERT_FALSE(unknown.trouble.ok());
  EXPECT_EQ(unknown.trouble.error().code, ErrorCode::Unsupported);
}

TEST(InspectOfAnAddedDevice, HearsItInACapture) {
  const auto known = types();
  const TemporaryFile file("inspected.pcap", capture());
  const auto seen = inspect_file(file.path(), known);
  ASSERT_TRUE(seen.trouble.ok()) << seen.trouble.error().message;
  EXPECT_EQ(seen.found->at("device"), "toy scanner");
  EXPECT_EQ(seen.found->at("source_address"), "192.168.1.201");
  EXPECT_EQ(seen.found->at("datagrams"), 4);
  EXPECT_EQ(seen.found->at("decoded").at("laser_returns"), 6);
  EXPECT_EQ(seen.found->at("decoded").at("malformed_bytes"), 0) << "the noise is counted, not decoded";
  const auto unknown = inspect_file(file.path());
  ASSERT_FALSE(unknown.trouble.ok());
  EXPECT_NE(unknown.trouble.error().message.find("none of its datagrams is one of a Hesai or a Livox or"),
            std::string::npos)
      << unknown.trouble.error().message;
}

}  // namespace
}  // namespace hueline
