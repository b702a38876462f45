#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/calendar.hpp"
#include "drivers/livox/livox_decoder.hpp"
#include "drivers/livox/livox_device.hpp"
#include "tests/drivers/livox/livox_packets.hpp"

namespace hueline::drivers {
namespace {

using test::Bytes;
using test::ByteWriter;
using test::LivoxFirst;
using test::LivoxSecond;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Decoded {
  std::vector<LaserBatch> batches;
  std::vector<LaserStatus> status;
  std::vector<TimeLabel> labels;
  std::vector<Fault> faults;
};

class Scanner {
 public:
  explicit Scanner(LivoxDecoder::Config config = {}) : decoder_(config) {}
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
  LivoxDecoder decoder_;
  std::uint64_t fed_ = 0;
};

std::uint64_t two(std::int32_t v) { return static_cast<std::uint32_t>(v); }

Bytes cartesian(std::int32_t x, std::int32_t y, std::int32_t z, unsigned reflectivity) {
  return ByteWriter(false).u32(two(x)).u32(two(y)).u32(two(z)).u8(reflectivity).u8(0).bytes();
}

/// One point of each form of both generations is the same place: 4 m forward, 2 m to the left, 4 m up, which is 6 m
/// away.
TEST(Livox, EveryFormOfAPointGivesItsPlace) {
  const Bytes xyz = cartesian(4000, 2000, 4000, 77);
  const double zenith = std::acos(4.0 / 6), azimuth = std::atan2(2.0, 4.0);
  const auto hundredths = [](double rad) { return static_cast<unsigned>(std::lround(rad * 18000 / 3.14159265358979)); };
  const Bytes direction = ByteWriter(false).u16(hundredths(zenith)).u16(hundredths(azimuth)).bytes();
  const Bytes depth = ByteWriter(false).u32(6000).bytes(), tail = ByteWriter(false).u8(77).u8(0).bytes();
  const auto join = [](std::initializer_list<Bytes> parts) {
    ByteWriter out(false);
    for (const Bytes& part : parts) out.raw(part);
    return out.bytes();
  };
  const Bytes nothing(14), no_return(6);
  const struct {
    unsigned type, firings, returns;
    Bytes point;
  } first[] = {
      {0, 100, 1, Bytes(xyz.begin(), xyz.end() - 1)},
      {1, 100, 1, join({depth, direction, Bytes(tail.begin(), tail.end() - 1)})},
      {2, 96, 1, xyz},
      {3, 96, 1, join({depth, direction, tail})},
      {4, 48, 1, join({nothing, xyz})},
      {5, 48, 1, join({direction, depth, tail, no_return})},
      {7, 30, 1, join({xyz, xyz, nothing})},
      {8, 30, 2, join({direction, depth, tail, no_return, ByteWriter(false).u32(9000).bytes(), tail})},
  };
  const auto check = [](const Decoded& out, std::size_t firings, unsigned returns, unsigned type) {
    ASSERT_EQ(out.batches.size(), 1u) << "type " << type;
    const auto& all = out.batches[0].returns;
    ASSERT_EQ(all.size(), firings * returns) << "type " << type;
    const LaserReturn& last = all[all.size() - returns];
    EXPECT_NEAR(last.x, -2, 1e-3) << "type " << type;
    EXPECT_NEAR(last.y, 4, 1e-3);
    EXPECT_NEAR(last.z, 4, 1e-3);
    EXPECT_NEAR(last.range_m, 6, 1e-3);
    EXPECT_NEAR(last.azimuth, 0.4636476, 1e-4);
    EXPECT_EQ(last.reflectivity, 77);
    EXPECT_EQ(last.return_number, 1);
    EXPECT_EQ(last.return_count, returns);
    EXPECT_TRUE(out.faults.empty());
  };
  for (const auto& form : first) {
    ByteWriter points(false);
    for (unsigned i = 0; i < form.firings; ++i) points.raw(form.point);
    LivoxFirst packet;
    packet.data_type = form.type;
    check(Scanner().take(packet.bytes(points.bytes())), form.firings, form.returns, form.type);
  }
  const Bytes centimetres = ByteWriter(false).u16(400).u16(200).u16(400).u8(77).u8(0).bytes();
  for (const auto& [type, point] : {std::pair<unsigned, Bytes>{0x01, xyz},
                                    {0x02, centimetres},
                                    {0x03, join({depth, direction, tail})},
                                    {0x11, join({xyz, nothing})}}) {
    LivoxSecond packet;
    packet.data_type = type;
    check(Scanner().take(packet.bytes(join({point, point, point}), 3)), 3, 1, 0x100 + type);
  }
}

Bytes points_of(unsigned count) {
  ByteWriter out(false);
  for (unsigned i = 0; i < count; ++i) out.raw(cartesian(1000, 0, 0, 1));
  return out.bytes();
}

/// The firings of the first generation are 25/6 us apart, or 10 us if the stamps say so; the second generation says it.
TEST(Livox, FiringsAreSpreadOverTheirPacket) {
  Scanner avia, mid;
  LivoxFirst packet;
  const auto last_offset = [](const Decoded& out) { return out.batches.at(0).returns.back().time_offset_ns; };
  EXPECT_EQ(last_offset(avia.take(packet.bytes(points_of(96)))), 395'833);
  EXPECT_EQ(last_offset(mid.take(packet.bytes(points_of(96)))), 395'833);
  packet.time = ByteWriter(false).u64(1'000'960'000).bytes();
  EXPECT_EQ(last_offset(mid.take(packet.bytes(points_of(96)), 960'000)), 950'000);
  LivoxSecond second;
  EXPECT_EQ(last_offset(Scanner().take(second.bytes(points_of(96), 96))), 475'000);
}

TEST(Livox, ATimeIsWhatThePacketSaysAndGetsNoOffset) {
  const Bytes points = points_of(96);
  const auto first = [&](unsigned type, const Bytes& time, LivoxDecoder::Scale scale = LivoxDecoder::Scale::Told) {
    LivoxFirst packet;
    packet.time_type = type;
    packet.time = time;
    return Scanner({.scale = scale, .min_range_m = 0, .max_range_m = {}}).take(packet.bytes(points));
  };
  const Bytes plain = ByteWriter(false).u64(1'700'000'000'250'000'000).bytes();
  const auto own = std::get<LaserCounter>(first(0, plain).batches.at(0).time);
  EXPECT_EQ(own.origin, CounterOrigin::Own);
  EXPECT_EQ(first(0, plain).status.at(0).clock, SyncState::Unlocked);
  EXPECT_TRUE(first(0, plain).labels.empty());

  const Decoded ptp = first(1, plain);
  EXPECT_EQ(std::get<LaserCounter>(ptp.batches.at(0).time).origin, CounterOrigin::Own);
  EXPECT_TRUE(ptp.labels.empty());
  EXPECT_THAT(ptp.status.at(0).words, HasSubstr("TAI or UTC"));
  const UnixTime unix_time(nanoseconds(1'700'000'000'250'000'000));
  EXPECT_EQ(std::get<UnixTime>(first(1, plain, LivoxDecoder::Scale::Utc).batches.at(0).time), unix_time);
  EXPECT_EQ(std::get<UnixTime>(first(1, plain, LivoxDecoder::Scale::Tai).batches.at(0).time),
            unix_time - std::chrono::seconds(37));

  // 2023-11-14T22:13:20.25Z
  const Bytes date = ByteWriter(false).u8(23).u8(11).u8(14).u8(22).u32(800'250'000).bytes();
  const Decoded gps = first(3, date);
  EXPECT_EQ(std::get<UnixTime>(gps.batches.at(0).time), unix_time);
  ASSERT_EQ(gps.labels.size(), 1u);
  EXPECT_TRUE(gps.labels[0].is_valid);
  EXPECT_EQ(gps.labels[0].second, from_unix(UnixTime(std::chrono::seconds(1'700'000'000))));
  const Bytes month_13 = ByteWriter(false).u8(23).u8(13).u8(14).u8(22).u32(0).bytes();
  EXPECT_EQ(first(3, month_13).faults.at(0).kind, FaultKind::Malformed);

  const auto pulse = std::get<LaserCounter>(first(4, ByteWriter(false).u64(250'000'000).bytes()).batches.at(0).time);
  EXPECT_EQ(pulse.origin, CounterOrigin::Utc);
  EXPECT_EQ(pulse.period, std::chrono::seconds(1));
  EXPECT_EQ(pulse.value, nanoseconds(250'000'000));

  // The rig says that a reference is followed: a scanner without one is not believed.
  const Decoded none = first(0, plain, LivoxDecoder::Scale::Utc);
  EXPECT_TRUE(none.batches.empty());
  EXPECT_EQ(none.faults.at(0).kind, FaultKind::NoTime);
}

TEST(Livox, TroublesOfTheClockAreTold) {
  const Bytes points = points_of(96);
  Scanner scanner;
  LivoxFirst packet;
  packet.time_type = 1;
  scanner.take(packet.bytes(points), 0);
  packet.status = 4u << 14;  // what the clock follows is abnormal
  packet.time = ByteWriter(false).u64(1'000'400'000).bytes();
  const Decoded abnormal = scanner.take(packet.bytes(points), 400'000);
  EXPECT_EQ(abnormal.faults.at(0).kind, FaultKind::NoTime);
  EXPECT_EQ(abnormal.status.at(0).clock, SyncState::Unlocked);
  packet.time_type = 0;
  packet.time = ByteWriter(false).u64(1'000'800'000).bytes();
  EXPECT_EQ(scanner.take(packet.bytes(points), 800'000).faults.at(0).kind, FaultKind::ClockStep);
  packet.time = ByteWriter(false).u64(38'001'200'000).bytes();
  const Decoded step = scanner.take(packet.bytes(points), 1'200'000);
  EXPECT_EQ(step.faults.at(0).kind, FaultKind::ClockStep);
  EXPECT_THAT(step.faults[0].detail, HasSubstr("37.0"));
}

TEST(Livox, LostRepeatedAndLatePacketsAreTold) {
  const auto kinds_of = [](const Decoded& out) {
    std::vector<std::pair<FaultKind, std::uint64_t>> kinds;
    for (const Fault& fault : out.faults) kinds.emplace_back(fault.kind, fault.count);
    return kinds;
  };
  using Kind = std::pair<FaultKind, std::uint64_t>;
  Scanner first;
  LivoxFirst packet;
  const auto at = [&](std::int64_t ns) {
    packet.time = ByteWriter(false).u64(static_cast<std::uint64_t>(1'000'000'000 + ns)).bytes();
    return kinds_of(first.take(packet.bytes(points_of(96)), ns));
  };
  EXPECT_THAT(at(0), IsEmpty());
  EXPECT_THAT(at(400'000), IsEmpty());
  EXPECT_THAT(at(1'600'000), ElementsAre(Kind{FaultKind::Lost, 2}));
  EXPECT_THAT(at(1'600'000), ElementsAre(Kind{FaultKind::Spurious, 1}));
  EXPECT_THAT(at(1'200'000), ElementsAre(Kind{FaultKind::Late, 1}));
  EXPECT_THAT(at(2'000'000), IsEmpty());

  Scanner second;
  LivoxSecond numbered;
  const auto number = [&](unsigned sequence, std::uint64_t ns) {
    numbered.sequence = sequence;
    numbered.time_ns = 1'000'000'000 + ns;
    return kinds_of(second.take(numbered.bytes(points_of(96), 96), static_cast<std::int64_t>(ns)));
  };
  EXPECT_THAT(number(5, 0), IsEmpty());
  EXPECT_THAT(number(6, 480'000), IsEmpty());
  EXPECT_THAT(number(9, 1'920'000), ElementsAre(Kind{FaultKind::Lost, 2}));
  EXPECT_THAT(number(0, 2'400'000), IsEmpty());  // a frame begins
  EXPECT_THAT(number(1, 2'880'000), IsEmpty());
}

TEST(Livox, WhatIsNoPacketOfTheScannerIsRefused) {
  Scanner scanner;
  EXPECT_EQ(scanner.take(Bytes(1206)).faults.at(0).kind, FaultKind::Malformed);
  LivoxFirst imu;
  imu.data_type = 6;
  EXPECT_TRUE(scanner.take(imu.bytes(Bytes(24))).faults.empty());
  LivoxFirst one, other;
  other.scanner = {2, 1};
  EXPECT_EQ(scanner.take(one.bytes(points_of(96))).batches.size(), 1u);
  const Decoded refused = scanner.take(other.bytes(points_of(96)));
  EXPECT_TRUE(refused.batches.empty());
  EXPECT_EQ(refused.faults.at(0).kind, FaultKind::WrongDevice);
}

TEST(Livox, AreRecognisedInCaptures) {
  const auto listener = kLivox.files.capture.listen("");
  const auto hear = [&](const Bytes& bytes) {
    Packet packet;
    packet.bytes = Buffer::copy_of(bytes);
    const auto heard = listener->listen(packet, "192.168.1.10");
    return heard ? heard->name : std::string();
  };
  EXPECT_THAT(hear(LivoxFirst().bytes(points_of(96))), HasSubstr("Avia"));
  EXPECT_THAT(hear(LivoxSecond().bytes(points_of(40), 40)), HasSubstr("Mid-360"));
  EXPECT_EQ(hear(Bytes(1206)), "");
  EXPECT_EQ(hear(LivoxSecond().bytes(points_of(40), 39)), "");
}

}  // namespace
}  // namespace hueline::drivers
