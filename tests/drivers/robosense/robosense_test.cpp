#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/calendar.hpp"
#include "drivers/robosense/robosense_decoder.hpp"
#include "drivers/robosense/robosense_device.hpp"
#include "tests/drivers/robosense/robosense_packets.hpp"

namespace hueline::drivers {
namespace {

using test::Bytes;
using test::ByteWriter;
using test::PcapWriter;
using test::RobosenseDifop;
using test::RobosensePoints;
using test::TemporaryFile;
using testing::HasSubstr;

constexpr double kRad = 3.14159265358979 / 180;
const UnixTime kStamp = UnixTime(std::chrono::seconds(1'700'000'000) + std::chrono::microseconds(250'125));

struct Decoded {
  std::vector<LaserBatch> batches;
  std::vector<LaserStatus> status;
  std::vector<TimeLabel> labels;
  std::vector<Fault> faults;
};

class Scanner {
 public:
  explicit Scanner(RobosenseDecoder::Config config = {}) : decoder_(config) {}
  Decoded take(const Bytes& bytes, std::int64_t received_ns = 0) {
    Packet packet;
    packet.received = HostTime(nanoseconds(received_ns));
    packet.bytes = Buffer::copy_of(bytes);
    std::vector<Measurement> measured;
    decoder_.decode(packet, measured);
    Decoded out;
    for (const Measurement& m : measured) {
      if (const auto* batch = std::get_if<LaserBatch>(&m)) out.batches.push_back(*batch);
      if (const auto* status = std::get_if<LaserStatus>(&m)) out.status.push_back(*status);
      if (const auto* label = std::get_if<TimeLabel>(&m)) out.labels.push_back(*label);
      if (const auto* fault = std::get_if<Fault>(&m)) out.faults.push_back(*fault);
    }
    fed_ += bytes.size();
    const DecodeCounts& c = decoder_.counts();
    EXPECT_EQ(c.decoded_bytes + c.ignored_bytes + c.malformed_bytes, fed_);
    return out;
  }

 private:
  RobosenseDecoder decoder_;
  std::uint64_t fed_ = 0;
};

Bytes seconds_time(std::uint64_t second, unsigned microsecond) {
  return ByteWriter(true).u16(0).u32(second).u32(microsecond).bytes();
}

/// What the tests need of a model, from its manual.
struct Model {
  const char* name;
  RobosensePoints points;
  RobosenseDifop difop;
  double unit_m, radius_m, height_m, period_us, second_us, last_us;  // times of the channels 1 and 31
};

std::vector<Model> models() {
  std::vector<Model> out;
  out.push_back({"RS-LiDAR-16", {}, {}, 0.005, 0.03825, 0, 55.5, 2.8, 97.5});
  out.back().difop.is_rs16 = true;
  out.back().difop.elevation = [](unsigned beam) {
    return beam < 8 ? -150'000 + 20'000 * static_cast<int>(beam) : 150'000 - 20'000 * static_cast<int>(beam - 8);
  };
  out.push_back({"RS-LiDAR-32", {}, {}, 0.005, 0.03997, 0, 55.52, 2.88, 46.08});
  out.back().points.type = {2, 0, 0};
  out.back().difop.elevation = [](unsigned beam) { return 1000 * static_cast<int>(beam) - 16'000; };
  out.back().difop.azimuth = [](unsigned beam) { return beam % 2 == 0 ? 3000 : -3000; };
  out.push_back({"RS-Bpearl", {}, {}, 0.005, 0.01473, 0.09427, 55.52, 2.56, 44.88});
  out.back().points.type = {0, 3, 0};
  out.back().difop.elevation = [](unsigned beam) { return 280 * static_cast<int>(beam); };
  out.push_back({"RS-Bpearl 4", {}, {}, 0.0025, 0.01619, 0.09571, 55.56, 1.668, 51.71});
  out.back().points.type = {0, 3, 4};
  out.back().difop.elevation = [](unsigned beam) { return 280 * static_cast<int>(beam); };
  out.push_back({"RS-Helios", {}, {}, 0.0025, 0.03498, 0, 55.56, 1.73, 53.63});
  out.back().points.is_helios = true;
  out.push_back({"RS-Helios-16P", {}, {}, 0.0025, 0.03498, 0, 55.56, 1.73, 81.51});
  out.back().points.is_helios = true;
  out.back().difop.beams = 16;
  for (Model& model : out) {
    const bool is_twice = model.difop.beams == 16 || model.difop.is_rs16;
    model.points.azimuth = [is_twice](unsigned block) {
      return 35'900 + (is_twice ? 40 : 20) * block < 36'000 ? 35'900 + (is_twice ? 40 : 20) * block
                                                            : 35'900 + (is_twice ? 40 : 20) * block - 36'000;
    };
    if (model.points.is_helios || model.points.type[2] == 4) model.points.time = seconds_time(1'700'000'000, 250'125);
  }
  return out;
}

/// Each return of a packet is where a second computation, from the drawing in the manuals, places it.
TEST(Robosense, ReturnsArePlacedAsTheManualsSay) {
  for (Model& model : models()) {
    SCOPED_TRACE(model.name);
    const bool is_rs16 = model.difop.is_rs16, is_twice = model.difop.beams == 16 || is_rs16;
    const double angle_unit = is_rs16 ? 1e-4 : std::string(model.name) == "RS-LiDAR-32" ? 1e-3 : 1e-2;
    Scanner scanner;
    EXPECT_TRUE(scanner.take(model.difop.bytes()).faults.empty());
    const Decoded out = scanner.take(model.points.bytes());
    ASSERT_EQ(out.batches.size(), 1u);
    EXPECT_TRUE(out.faults.empty());
    const auto& all = out.batches[0].returns;
    ASSERT_EQ(all.size(), 12u * 32);
    std::map<int, double> rings;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const unsigned block = static_cast<unsigned>(i / 32), channel = i % 32, beam = is_twice ? channel % 16 : channel;
      const LaserReturn& r = all[i];
      const double time_us = r.time_offset_ns * 1e-3 - block * model.period_us * (is_twice ? 2 : 1);
      if (channel == 0) {
        EXPECT_NEAR(time_us, 0, 1e-3);
      }
      if (channel == 1) {
        EXPECT_NEAR(time_us, model.second_us, 1e-2);
      }
      if (channel == 31) {
        EXPECT_NEAR(time_us, model.last_us, 0.1);
      }
      // The scanner turns 0.2 deg in a firing period.
      const double turned = (model.points.azimuth(block) * 0.01 + 0.2 * time_us / model.period_us) * kRad;
      const double azimuth = turned + (is_rs16 ? 0 : model.difop.azimuth(beam) * angle_unit * kRad);
      const double elevation = model.difop.elevation(beam) * angle_unit * kRad;
      const double range = 2000 * model.unit_m;
      EXPECT_NEAR(r.range_m, range, 1e-6);
      EXPECT_NEAR(r.x, range * std::cos(elevation) * std::sin(azimuth) + model.radius_m * std::sin(turned), 2e-5);
      EXPECT_NEAR(r.y, range * std::cos(elevation) * std::cos(azimuth) + model.radius_m * std::cos(turned), 2e-5);
      EXPECT_NEAR(r.z, range * std::sin(elevation) + model.height_m, 2e-5);
      EXPECT_EQ(r.reflectivity, 10 + channel);
      rings[r.channel] = elevation;
    }
    ASSERT_EQ(rings.size(), is_twice ? 16u : 32u);
    for (auto ring = std::next(rings.begin()); ring != rings.end(); ++ring)
      EXPECT_GT(ring->second, std::prev(ring)->second);
  }
}

/// Two points of a Helios 16P and two of a Bpearl 4, as another program decoded real packets (tier4 nebula): range,
/// elevation and azimuth in its columns, and place. They fix the place of the lens and the sense of all axes.
TEST(Robosense, TheLensIsWhereOtherDecodersHaveIt) {
  const struct {
    RobosenseModel model;
    double range, elevation_deg, azimuth_deg, forward, left, up;
  } points[] = {
      {RobosenseModel::Helios16, 0.2175, 10.92, 0.74, 0.2484042, -0.0056487122, 0.041202806},
      {RobosenseModel::Helios16, 8.2550001, 6.96, 0.87, 8.2280798, -0.12736985, 1.000311},
      {RobosenseModel::Bpearl4, 0.6225, 89.50, -49.82, 0.019663258, 0.0031394302, 0.71818626},
      {RobosenseModel::Bpearl4, 11.3075, 7.93, 3.36, 11.19628, -0.6573633, 1.6557285},
  };
  for (const auto& p : points) {
    const RobosenseTable& table = robosense_table(p.model);
    const double across = p.range * std::cos(p.elevation_deg * kRad);
    const double forward = p.forward - across * std::cos(p.azimuth_deg * kRad);
    const double left = p.left + across * std::sin(p.azimuth_deg * kRad);
    // Their angles are rounded to 0.01 deg, which is up to 1 mm at 11 m.
    const double rounding = 1e-4 * p.range + 5e-5;
    EXPECT_NEAR(std::hypot(forward, left), table.lens_radius_m, rounding);
    EXPECT_NEAR(p.up - p.range * std::sin(p.elevation_deg * kRad), table.lens_height_m, rounding);
    EXPECT_LT(left, 0);  // the lens is on the side to which the scanner has turned: azimuths are clockwise
  }
}

TEST(Robosense, BothReturnsOfAFiringAreCountedByRange) {
  for (Model& model : models()) {
    SCOPED_TRACE(model.name);
    const bool is_twice = model.difop.beams == 16 || model.difop.is_rs16;
    model.difop.returns = 0;
    // The first of a pair is the farther one; of channel 3 both are equal, of channel 5 one is missing.
    model.points.range = [&](unsigned block, unsigned channel) {
      const bool is_second = is_twice ? channel >= 16 : block % 2 == 1;
      const unsigned beam = is_twice ? channel % 16 : channel;
      return beam == 3 ? 1500u : is_second ? beam == 5 ? 0u : 1000u : 2000u;
    };
    model.points.azimuth = [&](unsigned block) { return 1000 + 20 * (is_twice ? block : block / 2); };
    Scanner scanner;
    scanner.take(model.difop.bytes());
    const Decoded out = scanner.take(model.points.bytes());
    ASSERT_EQ(out.batches.size(), 1u);
    const auto& all = out.batches[0].returns;
    const std::size_t beams = is_twice ? 16 : 32, firings = is_twice ? 12 : 6;
    ASSERT_EQ(all.size(), firings * (2 * beams - 2));
    EXPECT_NEAR(all[0].range_m, 1000 * model.unit_m, 1e-6);
    EXPECT_EQ(all[0].return_number, 1);
    EXPECT_EQ(all[1].return_number, 2);
    EXPECT_EQ(all[1].return_count, 2);
    EXPECT_EQ(all[0].time_offset_ns, all[1].time_offset_ns);
    EXPECT_EQ(all[6].return_count, 1);
    const double last_us = all.back().time_offset_ns * 1e-3;
    EXPECT_LT(last_us, model.period_us * static_cast<double>(firings));
    EXPECT_GT(last_us, model.period_us * static_cast<double>(firings - 1));
  }
}

TEST(Robosense, ADateIsBelievedOnlyWhileTheScannerFollowsAReference) {
  const auto run = [](const char* name, unsigned gps, unsigned sync, RobosenseDecoder::Reference reference) {
    for (Model& model : models()) {
      if (std::string(model.name) != name) continue;
      model.difop.gps = gps;
      model.difop.sync = sync;
      RobosenseDecoder::Config config;
      config.reference = reference;
      Scanner scanner(config);
      scanner.take(model.difop.bytes());
      return scanner.take(model.points.bytes());
    }
    return Decoded{};
  };
  using Reference = RobosenseDecoder::Reference;
  for (const char* name : {"RS-LiDAR-16", "RS-LiDAR-32", "RS-Bpearl"}) {
    const Decoded free = run(name, 0, 0, Reference::Told), locked = run(name, 1, 0, Reference::Told);
    EXPECT_EQ(std::get<LaserCounter>(free.batches.at(0).time).origin, CounterOrigin::Own) << name;
    EXPECT_EQ(free.status.at(0).clock, SyncState::Unlocked);
    EXPECT_TRUE(free.labels.empty());
    EXPECT_EQ(std::get<UnixTime>(locked.batches.at(0).time), kStamp) << name;
    ASSERT_EQ(locked.labels.size(), 1u);
    EXPECT_TRUE(locked.labels[0].is_valid);
    EXPECT_EQ(locked.labels[0].second, from_unix(std::chrono::floor<std::chrono::seconds>(kStamp)));
  }
  for (const char* name : {"RS-Helios", "RS-Bpearl 4"}) {
    EXPECT_EQ(std::get<UnixTime>(run(name, 0, 1, Reference::Told).batches.at(0).time), kStamp) << name;
    EXPECT_EQ(std::get<LaserCounter>(run(name, 0, 2, Reference::Told).batches.at(0).time).origin, CounterOrigin::Own);
    EXPECT_EQ(std::get<UnixTime>(run(name, 0, 2, Reference::PtpUtc).batches.at(0).time), kStamp);
    EXPECT_EQ(std::get<UnixTime>(run(name, 0, 2, Reference::PtpTai).batches.at(0).time),
              kStamp - std::chrono::seconds(37));
    const Decoded none = run(name, 0, 0, Reference::PtpUtc);
    EXPECT_TRUE(none.batches.empty());
    EXPECT_EQ(none.faults.at(0).kind, FaultKind::NoTime);
  }
}

TEST(Robosense, PointsBeforeTheDescriptionAreToldAndNotUsed) {
  Model model = models()[1];
  Scanner scanner;
  const Decoded early = scanner.take(model.points.bytes());
  EXPECT_TRUE(early.batches.empty());
  EXPECT_EQ(early.faults.at(0).kind, FaultKind::Implausible);
  EXPECT_THAT(early.faults[0].detail, HasSubstr("7788"));
  model.difop.elevation = [](unsigned) { return 0; };  // not calibrated
  EXPECT_EQ(scanner.take(model.difop.bytes()).faults.at(0).kind, FaultKind::Implausible);
  scanner.take(models()[1].difop.bytes());
  EXPECT_EQ(scanner.take(model.points.bytes()).batches.size(), 1u);
  model.points.type = {0, 3, 0};
  EXPECT_EQ(scanner.take(model.points.bytes()).faults.at(0).kind, FaultKind::WrongDevice);
  model.points.type = {0, 9, 0};
  EXPECT_EQ(scanner.take(model.points.bytes()).faults.at(0).kind, FaultKind::WrongDevice);
  EXPECT_EQ(scanner.take(Bytes(1248)).faults.at(0).kind, FaultKind::Malformed);
}

/// Captures without a description are decoded with the angles of a calibration file.
TEST(Robosense, GivenAnglesStandInForTheDescription) {
  Model model = models()[4];
  RobosenseDecoder::Config config;
  for (unsigned beam = 0; beam < 32; ++beam) {
    config.elevations_deg.push_back(beam);
    config.azimuths_deg.push_back(0);
  }
  Scanner with(config), described;
  described.take(model.difop.bytes());
  const auto expected = described.take(model.points.bytes()).batches.at(0).returns;
  const auto given = with.take(model.points.bytes()).batches.at(0).returns;
  ASSERT_EQ(given.size(), expected.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    EXPECT_NEAR(given[i].x, expected[i].x, 1e-6);
    EXPECT_NEAR(given[i].z, expected[i].z, 1e-6);
    EXPECT_EQ(given[i].time_offset_ns, expected[i].time_offset_ns);
  }
  model.points.azimuth = [](unsigned block) { return 1000 + 20 * (block / 2); };  // both returns
  model.points.range = [](unsigned block, unsigned) { return block % 2 == 0 ? 2000u : 1000u; };
  EXPECT_EQ(with.take(model.points.bytes(), 1000).faults.size(), 1u);  // the same time again
  model.points.time = seconds_time(1'700'000'000, 250'791);
  const auto both = with.take(model.points.bytes(), 666'000);
  EXPECT_EQ(both.batches.at(0).returns.at(1).return_count, 2);
  config.elevations_deg.resize(16);
  config.azimuths_deg.resize(16);
  EXPECT_EQ(Scanner(config).take(model.points.bytes()).batches.at(0).returns.size(), 12u * 32);  // a Helios 16P
}

TEST(Robosense, LostPacketsBrokenBlocksAndStepsOfTheClockAreTold) {
  Model model = models()[1];
  Scanner scanner;
  scanner.take(model.difop.bytes());
  const auto at = [&](unsigned microsecond, std::int64_t received_us) {
    model.points.time = ByteWriter(true)
                            .u8(23)
                            .u8(11)
                            .u8(14)
                            .u8(22)
                            .u8(13)
                            .u8(20)
                            .u16(microsecond / 1000)
                            .u16(microsecond % 1000)
                            .bytes();
    return scanner.take(model.points.bytes(), received_us * 1000).faults;
  };
  EXPECT_TRUE(at(1000, 0).empty());
  EXPECT_TRUE(at(1666, 666).empty());
  const auto lost = at(3665, 2665);  // three packets later
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_EQ(lost[0].kind, FaultKind::Lost);
  EXPECT_EQ(lost[0].count, 2u);
  EXPECT_EQ(at(3665, 2700).at(0).kind, FaultKind::Spurious);
  EXPECT_EQ(at(3000, 2800).at(0).kind, FaultKind::Late);
  EXPECT_EQ(at(900'000, 5000).at(0).kind, FaultKind::ClockStep);
  Bytes broken = model.points.bytes();
  broken[29] = std::byte{1};  // another microsecond
  broken[42] = broken[142] = std::byte{0};
  const Decoded out = scanner.take(broken, 5001'000);
  EXPECT_EQ(out.batches.at(0).returns.size(), 10u * 32);
  ASSERT_EQ(out.faults.size(), 1u);
  EXPECT_EQ(out.faults[0].kind, FaultKind::Malformed);
}

TEST(Robosense, ABpearlThatHangsTurnsTheOtherWay) {
  Model model = models()[2];
  model.points.azimuth = [](unsigned block) { return 9000 + 20 * block; };
  model.difop.reversed = 1;
  Scanner scanner;
  scanner.take(model.difop.bytes());
  const LaserReturn first = scanner.take(model.points.bytes()).batches.at(0).returns.at(0);
  EXPECT_NEAR(first.x, -10 - 0.01473, 1e-5);
  EXPECT_NEAR(first.azimuth, 270 * kRad, 1e-6);
}

/// 4 m forward, 2 m to the left and 4 m up, which is 6 m away, as the two scanners that do not rotate say it.
TEST(Robosense, PacketsOfM1AndE1SayWhereTheirPointsAre) {
  const auto head = [](unsigned sequence, unsigned returns, unsigned clock, unsigned microsecond) {
    return ByteWriter(true)
        .u32(0x55AA5AA5)
        .u16(sequence)
        .u16(0)
        .u8(returns)
        .u8(clock)
        .u16(0)
        .u32(1'700'000'000)
        .u32(microsecond)
        .zeros(12)
        .bytes();
  };
  const auto m1 = [&](unsigned sequence, unsigned returns = 4, unsigned clock = 0) {
    ByteWriter out(true);
    out.raw(head(sequence, returns, clock, 1000 + 158 * sequence));
    for (unsigned block = 0; block < 25; ++block) {
      out.u8(6 * block).u8(returns == 0 ? 1 + block % 2 : 0);
      for (unsigned point = 0; point < 5; ++point)
        out.u16(point == 4 ? 0 : 1200).u16(32768 + 4181).u16(32768 + 2657).u8(77).u8(0).u8(0);
    }
    return out.zeros(3).bytes();
  };
  const auto e1 = [&](unsigned sequence) {
    ByteWriter out(true);
    out.raw(head(sequence, 4, 0, 1000 + 347 * sequence));
    for (unsigned block = 0; block < 96; ++block)
      out.u16(3 * block).u16(1200).u16(21845).u16(10923).u16(21845).u8(77).u8(0);
    return out.zeros(16).bytes();
  };
  const auto check = [](const Decoded& out, std::size_t points, std::int32_t last_ns) {
    ASSERT_EQ(out.batches.size(), 1u);
    EXPECT_TRUE(out.faults.empty());
    ASSERT_EQ(out.batches[0].returns.size(), points);
    const LaserReturn& last = out.batches[0].returns.back();
    EXPECT_NEAR(last.x, -2, 2e-3);
    EXPECT_NEAR(last.y, 4, 2e-3);
    EXPECT_NEAR(last.z, 4, 2e-3);
    EXPECT_NEAR(last.range_m, 6, 1e-6);
    EXPECT_NEAR(last.azimuth, std::atan2(2.0, 4.0), 1e-3);
    EXPECT_EQ(last.time_offset_ns, last_ns);
    EXPECT_EQ(last.reflectivity, 77);
  };
  Scanner solid, other;
  check(solid.take(m1(1)), 100, 144'000);
  check(solid.take(m1(2), 158'000), 100, 144'000);
  const Decoded gap = solid.take(m1(5), 632'000);
  ASSERT_EQ(gap.faults.size(), 1u);
  EXPECT_EQ(gap.faults[0].kind, FaultKind::Lost);
  EXPECT_EQ(gap.faults[0].count, 2u);
  EXPECT_EQ(solid.take(e1(6)).faults.at(0).kind, FaultKind::WrongDevice);
  check(other.take(e1(1)), 96, 285'000);
  EXPECT_EQ(std::get<LaserCounter>(other.take(e1(2), 347'000).batches.at(0).time).origin, CounterOrigin::Own);
  const Decoded dual = Scanner().take(m1(1, 0));
  EXPECT_EQ(dual.batches.at(0).returns.at(4).return_number, 2);
  RobosenseDecoder::Config config;
  config.reference = RobosenseDecoder::Reference::PtpUtc;
  EXPECT_EQ(std::get<UnixTime>(Scanner(config).take(m1(1, 4, 2)).batches.at(0).time),
            UnixTime(std::chrono::seconds(1'700'000'000) + std::chrono::microseconds(1158)));
  EXPECT_EQ(Scanner(config).take(m1(1)).faults.at(0).kind, FaultKind::NoTime);
}

/// The description may come after the first points of a file: the listener looks for it.
TEST(Robosense, IsRecognisedInCapturesWithItsDescription) {
  const Model model = models()[4];
  const auto frame = [](const Bytes& payload, unsigned port) {
    return test::ethernet_frame(test::ipv4_packet(
        test::udp_segment(std::string(reinterpret_cast<const char*>(payload.data()), payload.size()), port)));
  };
  PcapWriter capture;
  capture.frame(1'000'000'000, frame(model.points.bytes(), 6699));
  capture.frame(1'000'100'000, frame(model.difop.bytes(), 7788));
  const TemporaryFile file("robosense.pcap", capture.bytes());
  const auto listener = kRobosense.files.capture.listen(file.path());
  Packet packet;
  packet.bytes = Buffer::copy_of(model.points.bytes());
  const auto heard = listener->listen(packet, "192.168.1.201");
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->name, "robosense RS-Helios");
  std::vector<Measurement> measured;
  heard->decoder->decode(packet, measured);
  EXPECT_TRUE(std::ranges::any_of(measured, [](const auto& m) { return std::holds_alternative<LaserBatch>(m); }));
  RobosensePoints unknown;
  unknown.type = {0, 7, 1};
  packet.bytes = Buffer::copy_of(unknown.bytes());
  EXPECT_FALSE(listener->listen(packet, "192.168.1.201"));
  EXPECT_THAT(listener->unknown_models(), HasSubstr("a RoboSense of type 0.7.1; known"));
  // An M2 has packets of another size.
  std::vector<std::byte> other(1342);
  std::ranges::copy(std::array{std::byte{0x55}, std::byte{0xAA}, std::byte{0x5A}, std::byte{0xA5}}, other.begin());
  packet.bytes = Buffer::copy_of(other);
  EXPECT_FALSE(listener->listen(packet, "192.168.1.201"));
  EXPECT_THAT(listener->unknown_models(), HasSubstr("or with packets of 1342 bytes; known"));
}

}  // namespace
}  // namespace hueline::drivers
