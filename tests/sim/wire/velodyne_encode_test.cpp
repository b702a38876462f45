#include "sim/wire/velodyne_encode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "tests/sim/recorded.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::sim {
namespace {

using test::load;

constexpr double kDegree = std::numbers::pi / 180.0;
/// 2016-01-21 08:00:00 UTC. There were 17 leap seconds then; the simulator's calendar always has 18. It is a full UTC
/// hour of the simulator.
constexpr GpsNs kUtcHour = (1'137'398'400LL + 18) * 1'000'000'000LL;

/// Reads from a recorded packet what encode_laser_data() was given.
LaserPacket parse(const std::vector<std::byte>& bytes) {
  LaserPacket packet;
  for (std::size_t block = 0; block < 12; ++block) {
    const std::size_t at = 100 * block;
    packet.azimuth_centideg[block] = load<std::uint16_t>(bytes, at + 2);
    for (std::size_t laser = 0; laser < 32; ++laser) {
      packet.distance_2mm.push_back(load<std::uint16_t>(bytes, at + 4 + 3 * laser));
      packet.reflectivity.push_back(load<std::uint8_t>(bytes, at + 6 + 3 * laser));
    }
  }
  packet.first_firing_gps_ns = kUtcHour + load<std::uint32_t>(bytes, 1200) * 1000LL;
  return packet;
}

class Recorded : public testing::TestWithParam<const char*> {};

TEST_P(Recorded, DataPacketsComeOutAgainBitByBit) {
  HUELINE_REQUIRE_DATA(GetParam());
  int compared = 0;
  for (const auto& bytes : test::udp_payloads(data_file)) {
    if (bytes.size() != kLaserDataBytes) continue;
    const auto encoded = encode_laser_data(parse(bytes), static_cast<LaserModel>(bytes[1205]),
                                           static_cast<LaserReturnMode>(bytes[1204]));
    ASSERT_TRUE(encoded.ok());
    ASSERT_EQ(*encoded, bytes) << "packet " << compared;
    ++compared;
  }
  EXPECT_GT(compared, 200);
}
INSTANTIATE_TEST_SUITE_P(Velodyne, Recorded,
                         testing::Values("velodyne/vlp16_gps.pcap", "velodyne/hdl32e.pcap",
                                         "velodyne/vlp16_scans.pcap"));

TEST(VelodyneEncode, RecordedPositionPacketComesOutAgain) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_gps.pcap");
  int compared = 0;
  for (const auto& bytes : test::udp_payloads(data_file)) {
    if (bytes.size() != kLaserPositionBytes) continue;
    LaserPositionReport report;
    report.sent_gps_ns = kUtcHour + load<std::uint32_t>(bytes, 198) * 1000LL;
    report.pps_status = load<std::uint8_t>(bytes, 202);
    for (std::size_t at = 206; at < 334 && bytes[at] != std::byte{0}; ++at) report.nmea += static_cast<char>(bytes[at]);
    const auto encoded = encode_laser_position(report);
    ASSERT_TRUE(encoded.ok());
    ASSERT_EQ(*encoded, bytes);
    ++compared;
  }
  EXPECT_EQ(compared, 57);
}

TEST(VelodyneEncode, GprmcEqualsTheRecordedSentence) {
  // From vlp16_gps.pcap, one second later in the calendar, because the simulator always has 18 leap seconds.
  RmcReport report;
  report.gps_ns = kUtcHour + (18 * 60 + 2) * 1'000'000'000LL;
  report.latitude_rad = (36 + 49.7478558 / 60) * kDegree;
  report.longitude_rad = -(2 + 24.4542928 / 60) * kDegree;
  report.speed_m_s = 0.034 * 1852.0 / 3600.0;
  report.course_rad = (212.5 - 360) * kDegree;
  EXPECT_EQ(encode_gprmc(report),
            "$GPRMC,081802.00,A,3649.7478558,N,00224.4542928,W,0.034,212.5,210116,0.0,E,A*2E\r\n");
}

TEST(VelodyneEncode, GprmcCarriesMinutesIntoDegrees) {
  RmcReport report;
  report.gps_ns = kUtcHour;
  report.is_valid = false;
  report.latitude_rad = -(9 + 59.99999999 / 60) * kDegree;
  EXPECT_THAT(encode_gprmc(report), testing::HasSubstr(",V,1000.0000000,S,00000.0000000,E,"));
}

TEST(VelodyneEncode, CounterWrapsAtTheUtcHourNotAtTheGpsHour) {
  LaserPacket packet;
  packet.distance_2mm.assign(384, 0);
  packet.reflectivity.assign(384, 0);
  const auto counter_at = [&](GpsNs t) {
    packet.first_firing_gps_ns = t;
    return load<std::uint32_t>(*encode_laser_data(packet, LaserModel::Vlp16, LaserReturnMode::Strongest), 1200);
  };
  EXPECT_EQ(counter_at(kUtcHour - 1), 3'599'999'999U);
  EXPECT_EQ(counter_at(kUtcHour), 0U);
  EXPECT_EQ(counter_at(kUtcHour + 1'999), 1U);
  EXPECT_EQ(counter_at(kUtcHour - 18'000'000'000LL), 3'582'000'000U);
}

TEST(VelodyneEncode, RefusesWhatDoesNotFit) {
  LaserPacket packet;
  EXPECT_EQ(encode_laser_data(packet, LaserModel::Vlp16, LaserReturnMode::Last).error().code, ErrorCode::Invalid);
  packet.distance_2mm.assign(384, 0);
  packet.reflectivity.assign(384, 0);
  packet.azimuth_centideg[3] = 36000;
  EXPECT_EQ(encode_laser_data(packet, LaserModel::Vlp16, LaserReturnMode::Last).error().code, ErrorCode::Invalid);
  EXPECT_EQ(encode_laser_position({0, 2, std::string(128, 'x')}).error().code, ErrorCode::Invalid);
}

}  // namespace
}  // namespace hueline::sim
