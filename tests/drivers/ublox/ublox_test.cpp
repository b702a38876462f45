// Messages of u-blox receivers, made here by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/ublox/ublox_decoder.hpp"
#include "drivers/ublox/ublox_logs.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;

Bytes ubx(int kind, int id, const Bytes& payload) {
  Bytes out{0xB5,
            0x62,
            static_cast<std::uint8_t>(kind),
            static_cast<std::uint8_t>(id),
            static_cast<std::uint8_t>(payload.size()),
            static_cast<std::uint8_t>(payload.size() >> 8)};
  out = out + payload;
  unsigned a = 0, b = 0;
  for (std::size_t i = 2; i < out.size(); ++i) {
    a = (a + out[i]) & 0xFF;
    b = (b + a) & 0xFF;
  }
  out.push_back(static_cast<std::uint8_t>(a));
  out.push_back(static_cast<std::uint8_t>(b));
  return out;
}

/// Sunday 2026-03-01, 00:00:18 GPS time and later: the UTC day begins at 18 s of the GPS week 2408.
struct Pvt {
  std::uint32_t itow_ms = 18'000;
  int hour = 0, minute = 0, second = 0, nano = 0;
  std::uint8_t valid = 7, fix = 3, flags = 1;
  std::int32_t longitude = 85'000'000, latitude = 473'000'000, height = 450'123;
  std::uint32_t time_accuracy_ns = 25;
};
Bytes pvt(const Pvt& p) {
  Fields f;
  f.put(p.itow_ms).put(std::uint16_t{2026}).put(std::uint8_t{3}).put(std::uint8_t{1});
  f.put(static_cast<std::uint8_t>(p.hour)).put(static_cast<std::uint8_t>(p.minute));
  f.put(static_cast<std::uint8_t>(p.second)).put(p.valid).put(p.time_accuracy_ns).put(p.nano);
  f.put(p.fix).put(p.flags).put(std::uint8_t{0}).put(std::uint8_t{17});
  f.put(p.longitude).put(p.latitude).put(p.height).put(std::int32_t{400'000});
  f.put(std::uint32_t{1414}).put(std::uint32_t{2000});                        // accuracy, mm
  f.put(std::int32_t{3000}).put(std::int32_t{4000}).put(std::int32_t{-500});  // velocity north, east, down, mm/s
  f.put(std::int32_t{5000}).put(std::int32_t{0}).put(std::uint32_t{100}).put(std::uint32_t{0});
  return ubx(1, 7, f.zeros(16).bytes);
}
Bytes attitude(std::uint32_t itow_ms) {
  Fields f;
  f.put(itow_ms).zeros(4).put(std::int32_t{100'000}).put(std::int32_t{-200'000}).put(std::int32_t{35'900'000});
  f.put(std::uint32_t{10'000}).put(std::uint32_t{20'000}).put(std::uint32_t{30'000});
  return ubx(1, 5, f.bytes);
}
Bytes mark(std::uint8_t flags, std::uint32_t accuracy_ns = 30, std::uint16_t week = 2408) {
  Fields f;
  f.put(std::uint8_t{1}).put(flags).put(std::uint16_t{42}).put(week).put(week);
  f.put(std::uint32_t{20'123}).put(std::uint32_t{456'789}).put(std::uint32_t{20'150}).put(std::uint32_t{1});
  return ubx(13, 3, f.put(accuracy_ns).bytes);
}
GpsTime at(std::int64_t ms) { return from_gps_week(2408, milliseconds(ms)); }

Heard decode(const Bytes& bytes, UbloxDecoder::Config config = {}) {
  UbloxDecoder decoder(config);
  Heard heard = hear(decoder, bytes, 1);
  EXPECT_EQ(heard.bytes(), bytes.size());
  return heard;
}

TEST(Ublox, PvtIsAFixAndALabel) {
  const Heard heard = decode(pvt({.nano = -312}));
  const auto fixes = heard.all<GnssFix>();
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].sensor, 7);
  EXPECT_EQ(fixes[0].time, at(18'000) - nanoseconds(312));
  EXPECT_EQ(fixes[0].type, FixType::Single);
  EXPECT_EQ(fixes[0].satellites, 17);
  EXPECT_DOUBLE_EQ(fixes[0].position.latitude, 47.3 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(fixes[0].position.longitude, 8.5 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(fixes[0].position.ellipsoidal_height, 450.123);
  EXPECT_NEAR(fixes[0].sigma_enu[0], 1.0, 1e-3);
  EXPECT_NEAR(fixes[0].sigma_enu[2], 2.0, 1e-12);
  const auto labels = heard.all<TimeLabel>();
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_EQ(labels[0].second, at(18'000));
  EXPECT_TRUE(labels[0].is_valid);
}

TEST(Ublox, KindOfFixFollowsTheFlags) {
  const auto type = [](std::uint8_t fix, std::uint8_t flags) {
    return decode(pvt({.fix = fix, .flags = flags})).all<GnssFix>().at(0).type;
  };
  EXPECT_EQ(type(3, 1), FixType::Single);
  EXPECT_EQ(type(3, 3), FixType::Dgnss);
  EXPECT_EQ(type(3, 0x43), FixType::RtkFloat);
  EXPECT_EQ(type(4, 0x83), FixType::RtkFixed);
  EXPECT_EQ(type(3, 0), FixType::Single);  // beyond the receiver's limits of accuracy
  EXPECT_EQ(type(0, 1), FixType::None);
  EXPECT_EQ(type(1, 1), FixType::None);
  EXPECT_EQ(type(5, 1), FixType::Single);
}

TEST(Ublox, OneLabelEachSecond) {
  Bytes bytes;
  for (int i = 0; i < 30; ++i)
    bytes = bytes +
            pvt({.itow_ms = 18'000u + 100u * static_cast<unsigned>(i), .second = i / 10, .nano = i % 10 * 100'000'000});
  const Heard heard = decode(bytes);
  EXPECT_EQ(heard.all<GnssFix>().size(), 30u);
  std::vector<GpsTime> seconds_named;
  for (const TimeLabel& label : heard.all<TimeLabel>()) seconds_named.push_back(label.second);
  EXPECT_THAT(seconds_named, ElementsAre(at(18'000), at(19'000), at(20'000)));
}

TEST(Ublox, AttitudeOfTheSameEpochMakesASolution) {
  const Heard heard = decode(pvt({.fix = 4}) + attitude(18'000) + pvt({.itow_ms = 19'000, .second = 1, .fix = 4}) +
                             attitude(19'000) + pvt({.itow_ms = 20'000, .second = 2, .fix = 4}));
  const auto solutions = heard.all<InsSolution>();
  ASSERT_EQ(solutions.size(), 2u);
  EXPECT_EQ(solutions[1].time, at(19'000));
  EXPECT_TRUE(solutions[1].is_good);
  EXPECT_NEAR(solutions[1].attitude.roll, 1 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[1].attitude.pitch, -2 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[1].attitude.heading, 359 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[1].velocity_enu.x(), 4, 1e-12);
  EXPECT_NEAR(solutions[1].velocity_enu.y(), 3, 1e-12);
  EXPECT_NEAR(solutions[1].velocity_enu.z(), 0.5, 1e-12);
  ASSERT_TRUE(solutions[1].sigma.has_value());
  EXPECT_NEAR((*solutions[1].sigma)[8], 0.3 * kRadPerDeg, 1e-12);
  EXPECT_EQ(heard.all<GnssFix>().size(), 3u);
}

/// HNR-PVT: a heading to the north-east, 5 m/s over ground, and up or down. `steps` tenths of a second have gone by at
/// this speed from the first place to the north-east (below 0: backwards).
struct HighRate {
  std::uint32_t itow_ms = 18'100;
  int steps = 0;
  std::int32_t height = 450'000;
  std::uint8_t fix = 4, valid = 7, flags = 0x1D;
};
Bytes high_rate(const HighRate& h) {
  Fields f;
  f.put(h.itow_ms).put(std::uint16_t{2026}).put(std::uint8_t{3}).put(std::uint8_t{1});
  f.put(std::uint8_t{0}).put(std::uint8_t{0}).put(static_cast<std::uint8_t>((h.itow_ms - 18'000) / 1000)).put(h.valid);
  f.put(static_cast<std::int32_t>((h.itow_ms % 1000) * 1'000'000 + 7));
  f.put(h.fix).put(h.flags).zeros(2);
  f.put(std::int32_t{85'000'000 + 468 * h.steps / 10}).put(std::int32_t{473'000'000 + 318 * h.steps / 10});
  f.put(h.height).put(std::int32_t{400'000});
  f.put(std::int32_t{5000}).put(std::int32_t{5025}).put(std::int32_t{4'500'000}).put(std::int32_t{4'500'000});
  f.put(std::uint32_t{1414}).put(std::uint32_t{2000}).put(std::uint32_t{173}).put(std::uint32_t{100'000});
  return ubx(0x28, 0, f.zeros(4).bytes);
}
Bytes high_rate_attitude(std::uint32_t itow_ms) {
  Fields f;
  f.put(itow_ms).put(std::uint8_t{1}).zeros(3);
  f.put(std::int32_t{100'000}).put(std::int32_t{-200'000}).put(std::int32_t{4'400'000});
  f.put(std::uint32_t{10'000}).put(std::uint32_t{20'000}).put(std::uint32_t{30'000});
  return ubx(0x28, 1, f.bytes);
}

TEST(Ublox, HighRateMessagesOfTheSameTimeMakeASolution) {
  const Heard heard =
      decode(high_rate({}) + high_rate_attitude(18'100) +
             high_rate({.itow_ms = 18'200, .steps = 1, .height = 450'050}) + high_rate_attitude(18'200) +
             high_rate_attitude(18'300) + high_rate({.itow_ms = 18'300, .steps = 2, .height = 450'000}) +
             high_rate({.itow_ms = 18'400}) + high_rate_attitude(18'500));
  const auto solutions = heard.all<InsSolution>();
  ASSERT_EQ(solutions.size(), 3u) << "an epoch that only one of the two names has none";
  EXPECT_EQ(solutions[1].time, at(18'200) + nanoseconds(7));
  EXPECT_TRUE(solutions[1].is_good);
  EXPECT_NEAR(solutions[1].position.latitude, 47.3000031 * kRadPerDeg, 1e-12);
  EXPECT_DOUBLE_EQ(solutions[1].position.ellipsoidal_height, 450.05);
  EXPECT_NEAR(solutions[1].attitude.roll, 1 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[1].attitude.pitch, -2 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[1].attitude.heading, 44 * kRadPerDeg, 1e-12);
  EXPECT_NEAR((*solutions[1].sigma)[0], 1, 1e-3);
  EXPECT_NEAR((*solutions[1].sigma)[8], 0.3 * kRadPerDeg, 1e-12);
}

/// The message has the speeds and the heading, but not whether the vehicle goes ahead and climbs: its steps tell.
TEST(Ublox, AHighRateVelocityFollowsTheStepsOfThePlaces) {
  std::vector<HighRate> drive{{},
                              {.itow_ms = 18'200, .steps = 1, .height = 450'050},   // up
                              {.itow_ms = 18'300, .steps = 2, .height = 450'000},   // down
                              {.itow_ms = 18'400, .steps = 1, .height = 449'950},   // down and back
                              {.itow_ms = 18'500, .steps = 9, .height = 455'000}};  // corrected by metres
  Bytes bytes;
  for (const HighRate& h : drive) bytes = bytes + high_rate(h) + high_rate_attitude(h.itow_ms);
  const auto solutions = decode(bytes).all<InsSolution>();
  ASSERT_EQ(solutions.size(), 5u);
  const auto expect = [&](std::size_t i, double level, double up) {
    EXPECT_NEAR(solutions[i].velocity_enu.x(), level, 0.1) << i;
    EXPECT_NEAR(solutions[i].velocity_enu.y(), level, 0.1) << i;
    EXPECT_NEAR(solutions[i].velocity_enu.z(), up, 1e-6) << i;
  };
  expect(0, 3.536, 0);
  expect(1, 3.536, 0.500625);
  expect(2, 3.536, -0.500625);
  expect(3, -3.536, -0.500625);
  expect(4, -3.536, -0.500625);
  EXPECT_NEAR((*solutions[0].sigma)[3], 5, 1e-6) << "whether it goes ahead is not known yet";
  EXPECT_NEAR((*solutions[0].sigma)[5], 0.500625, 1e-6);
  EXPECT_NEAR((*solutions[1].sigma)[3], 0.1, 1e-3);
  EXPECT_NEAR((*solutions[4].sigma)[5], 0.1, 1e-3);
}

TEST(Ublox, AHighRateSolutionIsGoodWhileInertialSensorsAreFused) {
  const auto is_good = [](const HighRate& h) {
    return decode(high_rate(h) + high_rate_attitude(h.itow_ms)).all<InsSolution>().at(0).is_good;
  };
  EXPECT_TRUE(is_good({}));
  EXPECT_TRUE(is_good({.fix = 1}));
  EXPECT_FALSE(is_good({.fix = 3}));
  EXPECT_FALSE(is_good({.flags = 0x1C})) << "beyond the receiver's limits";
  EXPECT_FALSE(is_good({.flags = 0x0D})) << "the heading of the vehicle is not known";
  EXPECT_TRUE(decode(high_rate({.valid = 4}) + high_rate_attitude(18'100)).all<InsSolution>().empty()) << "no date";
}

TEST(Ublox, TheEpochsMakeNoSolutionsBesideThoseOfHighRate) {
  const Heard heard =
      decode(high_rate({}) + high_rate_attitude(18'100) + pvt({.fix = 4}) + attitude(18'000) +
             high_rate({.itow_ms = 18'200}) + high_rate_attitude(18'200) + pvt({.itow_ms = 19'000, .second = 1}));
  EXPECT_EQ(heard.all<InsSolution>().size(), 2u);
  EXPECT_EQ(heard.all<GnssFix>().size(), 2u);
}

TEST(Ublox, ASolutionWithoutInertialSensorsIsNotGood) {
  const auto solutions = decode(pvt({.fix = 3}) + attitude(18'000)).all<InsSolution>();
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_FALSE(solutions[0].is_good);
}

TEST(Ublox, MarksByTheirTimeBase) {
  constexpr std::uint8_t kRising = 0x80, kFalling = 0x04, kValid = 0x40, kGnss = 1 << 3, kUtc = 2 << 3;
  const GpsTime edge = at(20'123) + nanoseconds(456'789);
  auto heard = decode(mark(kRising | kValid | kGnss));
  ASSERT_EQ(heard.all<EventMark>().size(), 1u);
  EXPECT_EQ(heard.all<EventMark>()[0].time, edge);
  EXPECT_EQ(heard.all<EventMark>()[0].input, 2);
  EXPECT_EQ(heard.all<EventMark>()[0].pulse_count, 42u);
  EXPECT_TRUE(heard.all<EventMark>()[0].is_valid);
  EXPECT_TRUE(heard.faults().empty());
  // A mark on UTC is 18 s earlier than the same numbers of GPS time: the classic mistake.
  EXPECT_EQ(decode(mark(kRising | kValid | kUtc)).all<EventMark>().at(0).time, edge + seconds(18));
  // Of the receiver's own clock, not valid, or bad: recorded, told and not trusted.
  for (const Bytes& bad : {mark(kRising | kValid), mark(kRising | kGnss), mark(kRising | kValid | kGnss, 5000)}) {
    heard = decode(bad);
    EXPECT_FALSE(heard.all<EventMark>().at(0).is_valid);
    EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime));
  }
  EXPECT_TRUE(decode(mark(kFalling | kValid | kGnss)).all<EventMark>().empty());
  const auto falling =
      decode(mark(kFalling | kValid | kGnss), {.mark_edge = UbloxDecoder::Edge::Falling}).all<EventMark>();
  ASSERT_EQ(falling.size(), 1u);
  EXPECT_EQ(falling[0].time, at(20'150) + nanoseconds(1));
}

TEST(Ublox, WithoutADateNothingIsStamped) {
  const Heard heard = decode(pvt({.valid = 0}) + pvt({.itow_ms = 19'000, .valid = 0}));
  EXPECT_TRUE(heard.all<GnssFix>().empty());
  EXPECT_TRUE(heard.all<TimeLabel>().empty());
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime));
}

/// The sentences beside it are not used, and lack nothing.
TEST(Ublox, AReceiverWithItsOwnMessagesNeedsNoGga) {
  const Bytes rmc = nmea("GNRMC,000000,A,4718.0,N,00830.0,E,0,0,010326,,,A");
  EXPECT_THAT(decode(rmc + pvt({})).faults(), ElementsAre());
  EXPECT_EQ(decode(rmc + pvt({})).all<GnssFix>().size(), 1u);
  EXPECT_THAT(decode(rmc).faults(), ElementsAre(FaultKind::Implausible));
}

TEST(Ublox, TheTimeOfTheWeekIsRightAndUtcIsNot) {
  // The receiver has not heard the leap seconds yet and takes them for 16.
  const Heard heard = decode(pvt({.second = 2}));
  EXPECT_EQ(heard.all<GnssFix>().at(0).time, at(18'000));
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::LabelConflict));
}

TEST(Ublox, RefusedCommandsAndLostEpochsAreTold) {
  EXPECT_THAT(decode(ubx(5, 0, {0x06, 0x8A})).faults(), ElementsAre(FaultKind::Refused));
  UbloxDecoder decoder({});
  std::vector<Measurement> out;
  for (int i = 0; i < 60; ++i) {
    const Bytes bytes = pvt({.itow_ms = 18'000u + 1000u * static_cast<unsigned>(i), .second = i});
    Packet packet;
    packet.received = host_time_ns(i * 1'000'000'000LL + 50'000'000);
    packet.bytes = Buffer::copy_of(std::as_bytes(std::span(bytes)));
    if (i != 30 && i != 31) decoder.decode(packet, out);
  }
  decoder.flush(out);
  const auto faults = Heard{out, {}}.all<Fault>();
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].kind, FaultKind::Lost);
  EXPECT_EQ(faults[0].count, 2u);
}

TEST(Ublox, AsksInTwoWays) {
  // NAV-PVT each epoch, by CFG-MSG; checked against the manual's example of its form.
  const std::string asked = UbloxLogs{.raw_observations = false}.dialogue();
  const Bytes pvt_asked = ubx(6, 1, {0x01, 0x07, 0x01});
  EXPECT_NE(asked.find(std::string(pvt_asked.begin(), pvt_asked.end())), std::string::npos);
  const std::string set = UbloxLogs{.port = UbloxLogs::Port::Usb}.dialogue();
  const Bytes pvt_set = ubx(6, 0x8A, {0, 1, 0, 0, 0x09, 0x00, 0x91, 0x20, 1});
  EXPECT_NE(set.find(std::string(pvt_set.begin(), pvt_set.end())), std::string::npos);
  // The receiver understands what it is sent: whole messages and nothing else.
  UbloxDecoder decoder({});
  const Heard heard = hear(decoder, bytes_of(asked + set));
  EXPECT_EQ(heard.counts.malformed_bytes, 0u);
  EXPECT_EQ(heard.counts.messages.at("CFG-VALSET"), 6u);
}

}  // namespace
}  // namespace hueline::drivers
