// Packets of each profile made by hand, metadata of both forms, and a real recording compared with the maker's
// published formulas.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/device.hpp"
#include "drivers/ouster/ouster_decoder.hpp"
#include "drivers/ouster/ouster_file.hpp"
#include "drivers/ouster/ouster_listener.hpp"
#include "drivers/transport/described_source.hpp"
#include "tests/drivers/ouster/ouster_packets.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::only;
using test::OusterPacket;
using test::OusterText;

std::vector<Measurement> decode(OusterDecoder& decoder, std::span<const std::byte> bytes,
                                std::int64_t received_ns = 0) {
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(bytes, received_ns), out);
  return out;
}

std::vector<Measurement> tell(OusterDecoder& decoder, const std::string& text, std::int64_t received_ns = 0) {
  return decode(decoder, std::as_bytes(std::span(text)), received_ns);
}

using Kinds = std::vector<FaultKind>;
Kinds kinds(const std::vector<Measurement>& measured) {
  Kinds out;
  for (const Fault& fault : only<Fault>(measured)) out.push_back(fault.kind);
  return out;
}

/// The returns of one packet of a scanner with such metadata.
std::vector<LaserReturn> returns_of(const OusterText& text, const OusterPacket& packet) {
  OusterDecoder decoder({});
  EXPECT_TRUE(kinds(tell(decoder, test::ouster_metadata(text))).empty());
  const auto measured = decode(decoder, test::ouster_bytes(packet));
  for (const Fault& fault : only<Fault>(measured)) ADD_FAILURE() << fault.detail;
  const auto batches = only<LaserBatch>(measured);
  EXPECT_EQ(batches.size(), 1u);
  return batches.empty() ? std::vector<LaserReturn>() : batches[0].returns;
}

TEST(Ouster, TheProfilesHaveRangeAndReflectivityWhereTheMakerSays) {
  struct Case {
    const char* profile;
    test::Bytes pixel;
    float range_m;
    int reflectivity;
  };
  const std::vector<Case> cases{
      {"LEGACY", test::pixel_legacy(0xFFFFF, 201), 1048.575f, 201},
      {"RNG19_RFL8_SIG16_NIR16", test::pixel_single(0x7FFFF, 202), 524.287f, 202},
      {"RNG15_RFL8_NIR8", test::pixel_low_rate(0x7FFF, 203), 262.136f, 203},
      {"RNG15_RFL8_WIN8", test::pixel_low_rate(0x7FFF, 203), 262.136f, 203},
  };
  for (const Case& one : cases) {
    OusterText text;
    text.profile = one.profile;
    OusterPacket packet;
    packet.is_legacy = std::string(one.profile) == "LEGACY";
    packet.pixel = one.pixel;
    const auto returns = returns_of(text, packet);
    ASSERT_EQ(returns.size(), 256u) << one.profile;
    for (const LaserReturn& r : returns) {
      EXPECT_FLOAT_EQ(r.range_m, one.range_m) << one.profile;
      EXPECT_EQ(r.reflectivity, one.reflectivity) << one.profile;
      EXPECT_EQ(r.return_number, 1);
      EXPECT_EQ(r.return_count, 1);
    }
  }
}

TEST(Ouster, OldFirmwareSendsTheReflectivityWith16Bits) {
  OusterText text;
  text.profile = "LEGACY";
  OusterPacket packet;
  packet.is_legacy = true;
  packet.pixel = test::pixel_legacy(5000, 0x4321);
  for (const auto& [firmware, expected] : std::vector<std::pair<std::string, int>>{
           {"v2.0.0-rc.2", 0x43}, {"v1.14.0", 0x43}, {"", 0x43}, {"v2.1.1", 0x21}}) {
    text.firmware = firmware;
    EXPECT_EQ(returns_of(text, packet).at(0).reflectivity, expected) << firmware;
  }
}

TEST(Ouster, TwoReturnsAreCountedByRangeAndEqualOnesAreOne) {
  OusterPacket packet;
  OusterText text;
  for (const bool is_low_rate : {false, true}) {
    text.profile = is_low_rate ? "FUSA_RNG15_RFL8_NIR8_DUAL" : "RNG19_RFL8_SIG16_NIR16_DUAL";
    text.header = is_low_rate ? "FUSA" : "STANDARD";
    packet.is_fusa = is_low_rate;
    const auto pixel = [&](unsigned first, unsigned second) {
      return is_low_rate ? test::pixel_low_rate_dual(first, 11, second, 22)
                         : test::pixel_dual(8 * first, 11, 8 * second, 22);
    };
    packet.pixel = pixel(1000, 500);
    auto returns = returns_of(text, packet);
    ASSERT_EQ(returns.size(), 512u);
    EXPECT_FLOAT_EQ(returns[0].range_m, 4);
    EXPECT_EQ(returns[0].reflectivity, 22);
    EXPECT_EQ(returns[0].return_number, 1);
    EXPECT_EQ(returns[0].return_count, 2);
    EXPECT_FLOAT_EQ(returns[1].range_m, 8);
    EXPECT_EQ(returns[1].reflectivity, 11);
    EXPECT_EQ(returns[1].return_number, 2);
    packet.pixel = pixel(1000, 0);
    returns = returns_of(text, packet);
    ASSERT_EQ(returns.size(), 256u);
    EXPECT_EQ(returns[0].return_count, 1);
    EXPECT_EQ(returns[0].reflectivity, 11);
    packet.pixel = pixel(0, 1000);
    returns = returns_of(text, packet);
    ASSERT_EQ(returns.size(), 256u);
    EXPECT_EQ(returns[0].return_number, 1);
    EXPECT_EQ(returns[0].reflectivity, 22);
    packet.pixel = pixel(1000, 1000);
    EXPECT_EQ(returns_of(text, packet).size(), 256u);
    packet.pixel = pixel(0, 0);
    EXPECT_EQ(returns_of(text, packet).size(), 0u);
  }
}

TEST(Ouster, AReturnLiesWhereTheBeamPointsAndHasTheTimeOfItsColumn) {
  OusterPacket packet;
  packet.first_column = 256;  // a quarter turn: the connector is behind, so this is to the left
  packet.pixel = test::pixel_single(10'000, 1);
  packet.invalid_columns = 0b10;
  const auto returns = returns_of({}, packet);
  ASSERT_EQ(returns.size(), 240u);
  const LaserReturn& r = returns[0];
  // The first channel points 16 degrees up and 3 degrees clockwise from 270 degrees; its beam begins 20 mm from the
  // centre.
  const double far = (10 - 0.02) * std::cos(16 * kRadPerDeg);
  EXPECT_NEAR(r.x, -far * std::cos(3 * kRadPerDeg) - 0.02, 1e-5);
  EXPECT_NEAR(r.y, far * std::sin(3 * kRadPerDeg), 1e-5);
  EXPECT_NEAR(r.z, (10 - 0.02) * std::sin(16 * kRadPerDeg), 1e-5);
  EXPECT_NEAR(r.azimuth, 273 * kRadPerDeg, 1e-5);
  EXPECT_EQ(r.channel, 15) << "the first channel is the highest";
  EXPECT_EQ(r.time_offset_ns, 0);
  EXPECT_EQ(returns[16].time_offset_ns, 200'000) << "the second column is not valid";
  EXPECT_EQ(returns.back().channel, 0);
}

TEST(Ouster, TheAngleOfTheEncoder0IsTowardsTheConnectorWhichIsBehind) {
  OusterPacket packet;
  packet.pixel = test::pixel_single(10'000, 1);
  const auto returns = returns_of({}, packet);
  EXPECT_LT(returns.at(0).y, -9);
  EXPECT_NEAR(returns[0].azimuth, 183 * kRadPerDeg, 1e-5);
  packet.first_column = 512;
  EXPECT_GT(returns_of({}, packet).at(0).y, 9);
}

TEST(Ouster, WhatIsMissingOrWrongIsSaid) {
  OusterDecoder decoder({});
  OusterPacket packet;
  packet.pixel = test::pixel_single(5000, 1);
  const auto send = [&](std::int64_t received_ns = 0) {
    return kinds(decode(decoder, test::ouster_bytes(packet), received_ns));
  };
  EXPECT_EQ(send(), Kinds{FaultKind::Implausible}) << "no metadata yet";
  tell(decoder, test::ouster_metadata());
  EXPECT_EQ(send(), Kinds{});
  EXPECT_EQ(send(), Kinds{FaultKind::Spurious}) << "again";
  packet.first_column = 32;
  EXPECT_EQ(send(), Kinds{FaultKind::Lost});
  packet.first_column = 16;
  EXPECT_EQ(send(), Kinds{FaultKind::Late});
  packet.first_column = 0;
  packet.frame = 6;
  const auto lost = only<Fault>(decode(decoder, test::ouster_bytes(packet)));
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_EQ(lost[0].count, 61u) << "the other 61 packets of the frame";
  packet.first_column = 16;
  packet.time_ns += 1'000'000'000;
  EXPECT_EQ(send(100'000'000), Kinds{FaultKind::ClockStep});
  packet.first_column = 32;
  packet.shot_limiting = 1;
  EXPECT_EQ(send(100'000'000), Kinds{FaultKind::Implausible}) << "hot";
  packet.first_column = 48;
  EXPECT_EQ(send(100'000'000), Kinds{}) << "still hot";
  packet.first_column = 0;
  packet.init_id = 78;
  EXPECT_EQ(send(100'000'000), (Kinds{FaultKind::Lost, FaultKind::Implausible})) << "started again";
  packet.serial = 5;
  EXPECT_EQ(send(), Kinds{FaultKind::WrongDevice});
  packet.channels = 32;
  EXPECT_EQ(send(), Kinds{FaultKind::WrongDevice}) << "the size of another scanner";
  EXPECT_EQ(kinds(decode(decoder, test::Bytes(1000))), Kinds{FaultKind::Malformed});
  EXPECT_EQ(kinds(tell(decoder, R"({"beam_altitude_angles": [1, 2, 3]})")), Kinds{FaultKind::Malformed});
  EXPECT_EQ(kinds(decode(decoder, test::Bytes(48))), Kinds{}) << "IMU";
  EXPECT_EQ(decoder.counts().messages.at("IMU"), 1u);
}

TEST(Ouster, TheNumberOfTheFrameWraps) {
  for (const bool is_fusa : {false, true}) {
    OusterDecoder decoder({});
    OusterText text;
    text.header = is_fusa ? "FUSA" : "STANDARD";
    tell(decoder, test::ouster_metadata(text));
    OusterPacket packet;
    packet.is_fusa = is_fusa;
    packet.pixel = test::pixel_single(5000, 1);
    packet.frame = is_fusa ? 0xFFFFFFFF : 0xFFFF;
    packet.first_column = 1008;
    EXPECT_EQ(kinds(decode(decoder, test::ouster_bytes(packet))), Kinds{});
    packet.frame = 0;
    packet.first_column = 0;
    EXPECT_EQ(kinds(decode(decoder, test::ouster_bytes(packet))), Kinds{});
    packet.first_column = 32;
    EXPECT_EQ(kinds(decode(decoder, test::ouster_bytes(packet))), Kinds{FaultKind::Lost});
  }
}

TEST(Ouster, PacketsOutsideAWindowAreNotMissing) {
  for (const bool is_through_0 : {false, true}) {
    OusterDecoder decoder({});
    OusterText text;
    text.window = is_through_0 ? "[1000, 20]" : "[100, 140]";
    tell(decoder, test::ouster_metadata(text));
    OusterPacket packet;
    packet.pixel = test::pixel_single(5000, 1);
    // The packets that hold a column of the window.
    const std::vector<int> sent = is_through_0 ? std::vector{0, 16, 992, 1008} : std::vector{96, 112, 128};
    for (packet.frame = 1; packet.frame < 4; ++packet.frame)
      for (const int column : sent) {
        packet.first_column = column;
        EXPECT_EQ(kinds(decode(decoder, test::ouster_bytes(packet))), Kinds{}) << packet.frame << ' ' << column;
      }
    packet.first_column = sent[1];
    EXPECT_EQ(kinds(decode(decoder, test::ouster_bytes(packet))), Kinds{FaultKind::Lost});
  }
}

/// The stamp of a packet that was sent at 2023-01-11 01:02:03 UTC, counted from 1970 with leap seconds or without.
constexpr std::uint64_t kUtcNs = 1'673'398'923'000'000'000, kTaiNs = kUtcNs + 37'000'000'000;

TEST(Ouster, NoScaleIsAssumed) {
  const GpsTime second = *from_utc({.year = 2023, .month = 1, .day = 11, .hour = 1, .minute = 2, .second = 3});
  const auto time_of = [](OusterDecoder::Scale scale, std::uint64_t stamp_ns, const OusterText& text) {
    OusterDecoder::Config config;
    config.scale = scale;
    OusterDecoder decoder(config);
    tell(decoder, test::ouster_metadata(text));
    OusterPacket packet;
    packet.pixel = test::pixel_single(5000, 1);
    packet.time_ns = stamp_ns;
    const auto measured = decode(decoder, test::ouster_bytes(packet));
    const auto batches = only<LaserBatch>(measured);
    return batches.empty() ? std::optional<LaserTime>() : std::optional(batches[0].time);
  };
  using Scale = OusterDecoder::Scale;
  OusterText ptp, nmea;
  ptp.timestamp_mode = "TIME_FROM_PTP_1588";
  nmea.timestamp_mode = "TIME_FROM_SYNC_PULSE_IN";
  nmea.io_mode = "INPUT_NMEA_UART";
  nmea.nmea_leap_seconds = 37;
  const auto own = time_of(Scale::Told, kTaiNs, ptp);
  ASSERT_TRUE(own && std::holds_alternative<LaserCounter>(*own)) << "a PTP master counts TAI or UTC: nobody says";
  EXPECT_EQ(std::get<LaserCounter>(*own).origin, CounterOrigin::Own);
  EXPECT_EQ(std::get<LaserCounter>(*own).value, nanoseconds(kTaiNs));
  EXPECT_EQ(time_of(Scale::Utc, kUtcNs, ptp), LaserTime(to_unix(second)));
  EXPECT_EQ(time_of(Scale::Tai, kTaiNs, ptp), LaserTime(to_unix(second)));
  EXPECT_EQ(time_of(Scale::Told, kTaiNs, nmea), LaserTime(to_unix(second))) << "the scanner adds what it is told to";
  const auto early = time_of(Scale::Told, 5'000'000'000, nmea);
  ASSERT_TRUE(early && std::holds_alternative<LaserCounter>(*early)) << "no sentence has come yet";
  EXPECT_FALSE(time_of(Scale::Utc, 5'000'000'000, ptp)) << "the rig says that it follows a reference; it does not";
}

std::string time_report(const std::string& mode, int pulse, int nmea, const std::string& port, double offset_ns) {
  return fmt::format(R"({{"sensor": {{"timestamp": {{"mode": "{}", "time": 5.1}}, "sync_pulse_in": {{"locked": {}}},
"multipurpose_io": {{"nmea": {{"locked": {}}}}}}}, "system": {{}}, "ptp": {{"port_data_set": {{"port_state": "{}"}},
"time_status_np": {{"master_offset": {}}}}}}})",
                     mode, pulse, nmea, port, offset_ns);
}

TEST(Ouster, AClockIsTrustedOnlyIfItSaysThatItIsLocked) {
  const auto state_of = [](const OusterText& text, const std::string& report) {
    OusterDecoder decoder({});
    tell(decoder, test::ouster_metadata(text));
    if (!report.empty()) tell(decoder, report);
    OusterPacket packet;
    packet.pixel = test::pixel_single(5000, 1);
    const auto states = only<LaserStatus>(decode(decoder, test::ouster_bytes(packet), 1'000'000'000));
    EXPECT_EQ(states.size(), 1u);
    return states.empty() ? SyncState::Holdover : states[0].clock;
  };
  const std::string osc = "TIME_FROM_INTERNAL_OSC", pulse = "TIME_FROM_SYNC_PULSE_IN", ptp = "TIME_FROM_PTP_1588";
  OusterText text;
  EXPECT_EQ(state_of(text, ""), SyncState::Unlocked);
  EXPECT_EQ(state_of(text, time_report(osc, 1, 1, "SLAVE", 0)), SyncState::Unlocked) << "it does not use them";
  text.timestamp_mode = pulse;
  EXPECT_EQ(state_of(text, ""), SyncState::Unlocked);
  EXPECT_EQ(state_of(text, time_report(pulse, 1, 0, "LISTENING", 0)), SyncState::Locked);
  EXPECT_EQ(state_of(text, time_report(pulse, 0, 0, "SLAVE", 0)), SyncState::Unlocked);
  text.io_mode = "INPUT_NMEA_UART";
  EXPECT_EQ(state_of(text, time_report(pulse, 1, 0, "LISTENING", 0)), SyncState::Acquiring);
  EXPECT_EQ(state_of(text, time_report(pulse, 1, 1, "LISTENING", 0)), SyncState::Locked);
  text.timestamp_mode = ptp;
  EXPECT_EQ(state_of(text, ""), SyncState::Unlocked);
  EXPECT_EQ(state_of(text, time_report(ptp, 0, 0, "SLAVE", 1500)), SyncState::Locked);
  EXPECT_EQ(state_of(text, time_report(ptp, 0, 0, "SLAVE", -3.7e8)), SyncState::Acquiring) << "it has not settled";
  EXPECT_EQ(state_of(text, time_report(ptp, 0, 0, "UNCALIBRATED", 0)), SyncState::Acquiring);
  EXPECT_EQ(state_of(text, time_report(ptp, 0, 0, "LISTENING", 0)), SyncState::Unlocked);
}

TEST(Ouster, AnOldReportOfItsClockIsNotBelieved) {
  OusterDecoder decoder({});
  OusterText text;
  text.timestamp_mode = "TIME_FROM_SYNC_PULSE_IN";
  tell(decoder, test::ouster_metadata(text));
  tell(decoder, time_report("TIME_FROM_SYNC_PULSE_IN", 1, 1, "", 0));
  OusterPacket packet;
  packet.pixel = test::pixel_single(5000, 1);
  const auto late = only<LaserStatus>(decode(decoder, test::ouster_bytes(packet), 20'000'000'000));
  ASSERT_EQ(late.size(), 1u);
  EXPECT_EQ(late[0].clock, SyncState::Unlocked);
}

TEST(OusterMetadata, BothFormsAndTheValuesOfOldFirmwareAreRead) {
  const auto nested = parse_ouster_metadata(test::ouster_metadata());
  ASSERT_TRUE(nested.ok()) << nested.error().message;
  EXPECT_EQ(nested->product, "OS-1-16");
  EXPECT_EQ(nested->serial, 122000000001u);
  EXPECT_NEAR(nested->beam_x_m, 0.02, 1e-12);
  const auto flat = parse_ouster_metadata(
      R"({"beam_altitude_angles": [3, 1, -1, -3], "beam_azimuth_angles": [1, 1, 1, 1], "lidar_mode": "512x20"})");
  ASSERT_TRUE(flat.ok()) << flat.error().message;
  EXPECT_TRUE(flat->is_legacy());
  EXPECT_EQ(flat->columns_per_frame, 512);
  EXPECT_EQ(flat->columns_per_packet, 16);
  EXPECT_NEAR(flat->beam_x_m, 0.012163, 1e-12);
  EXPECT_EQ(flat->R_sensor_lidar(0, 0), -1);
  EXPECT_EQ(flat->packet_bytes(), 16u * (16 + 4 * 12 + 4));
}

TEST(OusterMetadata, WhatIsWrongIsNamed) {
  const auto message = [](const std::string& text) {
    const auto parsed = parse_ouster_metadata(text);
    return parsed.ok() ? "" : parsed.error().message;
  };
  const auto with = [](const std::string& part, const std::string& instead) {
    std::string text = test::ouster_metadata();
    const auto at = text.find(part);
    EXPECT_NE(at, std::string::npos) << part;
    return text.replace(at, part.size(), instead);
  };
  EXPECT_NE(message("{").find("not JSON"), std::string::npos);
  EXPECT_NE(message("[]").find("beam_altitude_angles is missing"), std::string::npos);
  EXPECT_NE(message(with("\"columns_per_packet\": 16", "\"columns_per_packet\": 0")).find("columns_per_packet"),
            std::string::npos);
  EXPECT_NE(message(with("[0, 1023]", "[0, 1024]")).find("column_window"), std::string::npos);
  EXPECT_NE(message(with("\"pixels_per_column\": 16", "\"pixels_per_column\": 32")).find("pixels_per_column"),
            std::string::npos);
  EXPECT_NE(message(with("RNG19_RFL8_SIG16_NIR16", "RNG99")).find("RNG99"), std::string::npos);
  EXPECT_NE(message(with("[-1,0,0,0, 0,-1,0,0,", "[-2,0,0,0, 0,-1,0,0,")).find("no rotation"), std::string::npos);
  OusterText flat;
  flat.first_altitude_deg = 100;
  EXPECT_NE(message(test::ouster_metadata(flat)).find("beyond 90"), std::string::npos);
}

TEST(OusterFile, TheMetadataComeBeforeTheFirstPacketWithItsArrival) {
  class One final : public PacketSource {
   public:
    Status open() override { return {}; }
    Result<Packet> next(std::stop_token) override {
      if (sent_++ == 0) return Error{ErrorCode::TimedOut, ""};
      return test::packet_of(test::Bytes(48), 1000 + sent_);
    }
    void close() override {}

   private:
    int sent_ = 0;
  };
  const test::TemporaryFolder folder;
  const auto file = folder / "metadata.json";
  std::ofstream(file) << test::ouster_metadata();
  DescribedSource source(std::make_unique<One>(), [&] { return describe_ouster(file.string()); });
  ASSERT_TRUE(source.open().ok());
  EXPECT_EQ(source.next({}).error().code, ErrorCode::TimedOut);
  const auto first = source.next({});
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first->bytes.size(), test::ouster_metadata().size());
  EXPECT_EQ(first->received, host_time_ns(1002));
  const auto second = source.next({});
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(second->bytes.size(), 48u);
  EXPECT_EQ(second->received, host_time_ns(1002));
  EXPECT_EQ(source.next({})->received, host_time_ns(1003));

  DescribedSource missing(std::make_unique<One>(), [&] { return describe_ouster((folder / "none.json").string()); });
  EXPECT_EQ(missing.open().error().code, ErrorCode::Invalid);
}

TEST(OusterListener, WithoutMetadataItSaysWhatIsMissing) {
  const test::TemporaryFolder folder;
  const auto listener = listen_for_ouster((folder / "drive.pcap").string());
  OusterPacket packet;
  packet.pixel = test::pixel_single(5000, 1);
  const Packet datagram = test::packet_of(test::ouster_bytes(packet));
  EXPECT_FALSE(listener->listen(datagram, "192.168.1.5"));
  EXPECT_NE(listener->unknown_models().find("/api/v1/sensor/metadata"), std::string::npos);
  EXPECT_FALSE(listener->listen(test::packet_of(test::Bytes(1206)), "192.168.1.5"));

  std::ofstream(folder / "drive.json") << test::ouster_metadata();
  OusterText other;
  other.serial = "5";
  std::ofstream(folder / "other.json") << test::ouster_metadata(other);
  const auto again = listen_for_ouster((folder / "drive.pcap").string());
  const auto heard = again->listen(datagram, "192.168.1.5");
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->name, "ouster OS-1-16, RNG19_RFL8_SIG16_NIR16");
  EXPECT_NE(heard->note.find("drive.json"), std::string::npos);
  EXPECT_TRUE(again->is_decodable(datagram));
  EXPECT_TRUE(again->is_decodable(test::packet_of(test::Bytes(48)))) << "IMU";
  EXPECT_EQ(again->use_description((folder / "none.json").string()).error().code, ErrorCode::Io);
}

TEST(OusterListener, PacketsOfItsInertialSensorAloneAreNamed) {
  const auto imu = [](std::uint64_t accelerated, std::uint64_t turned, float gravity) {
    test::ByteWriter out(false);
    out.u64(1).u64(accelerated).u64(turned);
    for (const float value : {0.01F, -0.02F, gravity, 1.5F, -20.0F, 0.0F}) out.u32(std::bit_cast<std::uint32_t>(value));
    return test::packet_of(out.bytes());
  };
  const test::TemporaryFolder folder;
  const auto listener = listen_for_ouster((folder / "drive.pcap").string());
  EXPECT_FALSE(listener->listen(imu(1'000'000'000, 1'001'000'000, 0.98F), "192.168.1.5"));
  EXPECT_FALSE(listener->listen(imu(1'000'000'000, 5'001'000'000, 0.98F), "192.168.1.5")) << "of two moments";
  EXPECT_FALSE(listener->listen(imu(1'000'000'000, 1'001'000'000, 1e20F), "192.168.1.5")) << "no acceleration";
  EXPECT_FALSE(listener->listen(test::packet_of(test::Bytes(48)), "192.168.1.5")) << "nothing";
  EXPECT_TRUE(listener->lone_packets().starts_with("1 packet of the inertial sensor of an Ouster"))
      << listener->lone_packets();
  OusterPacket packet;
  packet.pixel = test::pixel_single(5000, 1);
  EXPECT_FALSE(listener->listen(test::packet_of(test::ouster_bytes(packet)), "192.168.1.5"));
  EXPECT_EQ(listener->lone_packets(), "") << "its data packets say what it is";
}

/// The maker's formulas, in its lidar frame: range r from beam origin at n, encoder and beam angles counted clockwise.
TEST(OusterCaptures, AnOs1LiesWhereTheMakersFormulasSay) {
  HUELINE_REQUIRE_DATA("ouster/os1_example.pcap");
  const auto text = read_ouster_metadata_file((test::data_dir() / "ouster" / "os1_example.json").string());
  ASSERT_TRUE(text.ok());
  const auto metadata = parse_ouster_metadata(*text);
  ASSERT_TRUE(metadata.ok()) << metadata.error().message;
  OusterDecoder decoder({}, *metadata);
  const auto packets = test::capture_packets(data_file.string());
  std::size_t points = 0, data = 0;
  double largest_m = 0;
  for (std::size_t p = 0; p < packets.size(); p += 4) {
    const auto bytes = packets[p].bytes.bytes();
    if (bytes.size() != 12608) continue;
    ++data;
    decoder.reset();
    std::vector<Measurement> out;
    decoder.decode(packets[p], out);
    const auto batches = only<LaserBatch>(out);
    ASSERT_EQ(batches.size(), 1u);
    auto next = batches[0].returns.begin();
    const auto number = [&](std::size_t at, int count) {
      std::uint64_t v = 0;
      for (int i = count; i-- > 0;) v = v << 8U | static_cast<std::uint64_t>(bytes[at + static_cast<std::size_t>(i)]);
      return v;
    };
    for (std::size_t column = 0; column < 16; ++column) {
      const std::size_t at = column * 788;
      if (number(at + 784, 4) != 0xFFFFFFFF) continue;
      const double encoder = 2 * std::numbers::pi * (1 - static_cast<double>(number(at + 8, 2)) / 1024);
      for (std::size_t c = 0; c < 64; ++c) {
        const double r = static_cast<double>(number(at + 16 + 12 * c, 4) & 0xFFFFF) * 1e-3, n = 0.012163;
        if (r < 0.05) continue;
        const double angle = encoder - metadata->azimuths_deg[c] * kRadPerDeg;
        const double altitude = metadata->altitudes_deg[c] * kRadPerDeg;
        const double x = (r - n) * std::cos(angle) * std::cos(altitude) + n * std::cos(encoder);
        const double y = (r - n) * std::sin(angle) * std::cos(altitude) + n * std::sin(encoder);
        const double z = (r - n) * std::sin(altitude);
        ASSERT_NE(next, batches[0].returns.end());
        // The sensor frame is turned by half a turn; ours has its y along its x, and x to the right.
        largest_m = std::max(largest_m, std::hypot(next->x - y, next->y + x, next->z - z));
        EXPECT_EQ(next->time_offset_ns, static_cast<std::int64_t>(number(at, 8) - number(0, 8)));
        ++next;
        ++points;
      }
    }
    EXPECT_EQ(next, batches[0].returns.end());
  }
  EXPECT_EQ(data, packets.size() / 4);
  EXPECT_GT(points, 20'000u);
  std::printf("%zu points, largest difference %.7f m\n", points, largest_m);
  EXPECT_LT(largest_m, 5e-5);
}

}  // namespace
}  // namespace hueline::drivers
