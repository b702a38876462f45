// Adds a kind of device that the program does not have, by a folder (toy_scanner/) and one line (kTypes). Its rig is
// read, and its packets become points.
#include <gtest/gtest.h>

#include "config/section.hpp"
#include "core/calendar.hpp"
#include "core/coloured_point.hpp"
#include "runtime/pipeline.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"
#include "tests/runtime/toy_scanner/toy_scanner.hpp"

namespace hueline {
namespace {

std::vector<const drivers::DeviceType*> types() {
  std::vector<const drivers::DeviceType*> all(drivers::device_types().begin(), drivers::device_types().end());
  all.push_back(&toy::kToyScanner);
  return all;
}

std::string rig_text(const std::string& keys) {
  return "rig: r\nsensors:\n  - {name: pos, driver: novatel, file: drive.gps}\n  - {name: toy, driver: toy_scanner, "
         "file: toy.bin" +
         keys +
         ", T_body_scanner: {position_m: [0, 0, 2], quaternion_wxyz: [1, 0, 0, 0]}}\ncolouring: {method: lens}\n";
}

struct Points : runtime::ProductSink {
  std::vector<ColouredPoint> points;
  void on_cloud(const CloudBlock& block, const fusion::Trajectory&) override {
    points.insert(points.end(), block.points.begin(), block.points.end());
  }
};

TEST(AddedDevice, ItsKeysAreReadAndRefusedLikeThoseOfEveryDevice) {
  const auto known = types();
  const config::Rig rig = config::parse_rig(rig_text(", min_range_m: 2"), "rig.yaml", known);
  EXPECT_STREQ(rig.sensors.at(1).driver(), "toy_scanner");
  EXPECT_EQ(rig.geometry.lasers.size(), 1u);
  const auto complaint = [&](const std::string& keys, drivers::DeviceTypes given) {
    try {
      config::parse_rig(rig_text(keys), "rig.yaml", given);
    } catch (const config::ConfigError& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  EXPECT_EQ(complaint(", min_range_m: -1", known),
            "rig.yaml:4: key 'sensors[1].min_range_m' is '-1'; allowed: a number from 0 to 100 m");
  EXPECT_NE(complaint(", max_range_m: 1", known).find("(did you mean min_range_m?)"), std::string::npos);
  EXPECT_NE(
      complaint("", drivers::device_types()).find("'sensors[1].driver' is 'toy_scanner'; allowed: one of: velodyne"),
      std::string::npos);
}

TEST(AddedDevice, ItsPacketsBecomePoints) {
  const auto known = types();
  const config::Rig rig = config::parse_rig(rig_text(", min_range_m: 2"), "rig.yaml", known);
  Points sink;
  runtime::Pipeline pipeline(rig, 1, sink);
  std::uint64_t sequence = 0;
  const auto enter = [&](SensorId sensor, std::int64_t at_ms, std::span<const std::byte> bytes) {
    Packet packet;
    packet.sensor = sensor;
    packet.sequence = sequence++;
    packet.received = host_time_ns(at_ms * 1'000'000);
    packet.bytes = Buffer::copy_of(bytes);
    pipeline.process(packet);
  };
  // The vehicle stands for ten seconds at one place, heading north. The scanner sees two points ahead, and one too
  // near.
  const std::array<std::array<float, 3>, 3> seen{{{0, 10, 0}, {5, 10, 0}, {0, 1, 0}}};
  for (std::int64_t at_ms = 0; at_ms < 10'000; at_ms += 10) {
    const GpsTime now = from_gps_week(2300, std::chrono::milliseconds(100'000'000 + at_ms));
    enter(1, at_ms,
          test::inspvas({.week = 2300,
                         .seconds = 100'000 + static_cast<double>(at_ms) * 1e-3,
                         .latitude_deg = 48,
                         .longitude_deg = 11,
                         .height = 500}));
    if (at_ms % 1000 == 0) enter(2, at_ms, toy::encode('S', now));
    enter(2, at_ms, toy::encode('D', now - std::chrono::milliseconds(2), seen));
  }
  pipeline.flush();
  EXPECT_GE(sink.points.size(), 1800u);
  EXPECT_LE(sink.points.size(), 2000u);
  ASSERT_GE(sink.points.size(), 2u);
  ASSERT_EQ(sink.points.size() % 2, 0u);
  for (std::size_t i = 0; i < sink.points.size(); i += 2) {
    EXPECT_NEAR(sink.points[i + 1].east - sink.points[i].east, 5, 1e-3);
    EXPECT_NEAR(sink.points[i + 1].north - sink.points[i].north, 0, 1e-3);
  }
}

}  // namespace
}  // namespace hueline
