// Datagrams of a profile scanner, written by hand from the description of the format: fields, time, losses, broken
// bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/calendar.hpp"
#include "tests/drivers/profile_scanner/profile_scanner_packets.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::seconds;
using test::ProfileDatagram;
using test::ProfileDecoded;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kTurn = 2 * std::numbers::pi;

/// Four pulses an eighth of a turn apart, beginning at a quarter of a turn: one return, none, three, one.
ProfileDatagram four_pulses() {
  ProfileDatagram d;
  d.angle = 0x40000000;
  d.step = 0x20000000;
  d.period_ps = 833'333;
  d.pulses = {{{100'000, 5000}}, {}, {{20'000, 10'000}, {40'000, 65'535}, {2'000'000, 49}}, {{30'000, 0}}};
  return d;
}

TEST(ProfileScanner, PlacesAndTimesFollowFromTheFields) {
  ProfileDecoded decoded;
  decoded.feed(four_pulses());
  const auto batches = decoded.all<LaserBatch>();
  ASSERT_EQ(batches.size(), 1u);
  EXPECT_EQ(batches[0].sensor, 5);
  const auto& r = batches[0].returns;
  ASSERT_EQ(r.size(), 5u);
  // A quarter of a turn from +y, clockwise seen from +z, is +x.
  EXPECT_NEAR(r[0].x, 10, 1e-6);
  EXPECT_NEAR(r[0].y, 0, 1e-6);
  EXPECT_EQ(r[0].z, 0);
  EXPECT_EQ(r[0].time_offset_ns, 0);
  EXPECT_NEAR(r[0].azimuth, kTurn / 4, 1e-6);
  EXPECT_EQ(r[0].reflectivity, 50);
  EXPECT_EQ(r[0].return_count, 1);
  // Two steps later: half a turn, so -y.
  const float ranges[] = {2, 4, 200};
  const int reflectivities[] = {100, 255, 0};
  for (int i = 0; i < 3; ++i) {
    const LaserReturn& one = r[static_cast<std::size_t>(1 + i)];
    EXPECT_NEAR(one.range_m, ranges[i], 1e-5);
    EXPECT_NEAR(one.y, -ranges[i], 2e-5);
    EXPECT_NEAR(one.x, 0, 2e-5);
    EXPECT_EQ(one.time_offset_ns, 1667);  // 2 x 833.333 ns
    EXPECT_EQ(one.return_number, i + 1);
    EXPECT_EQ(one.return_count, 3);
    EXPECT_EQ(one.reflectivity, reflectivities[i]);
  }
  EXPECT_EQ(r[4].time_offset_ns, 2500);
  EXPECT_NEAR(r[4].azimuth, kTurn * 5 / 8, 1e-6);
  EXPECT_NEAR(r[4].x, -3 * std::numbers::sqrt2 / 2, 1e-6);
  EXPECT_THAT(decoded.faults(), IsEmpty());
  EXPECT_TRUE(decoded.is_every_byte_counted());
}

TEST(ProfileScanner, ALongDatagramTurnsThroughZeroWithoutLosingTheAngle) {
  ProfileDatagram d;
  d.angle = 0xFFFF0000;
  d.step = 858'993;  // 200 lines of 1 M pulses a second
  d.pulses.assign(9000, {{1'000'000}});
  ProfileDecoded decoded;
  decoded.feed(d);
  const auto batches = decoded.all<LaserBatch>();
  ASSERT_EQ(batches.size(), 1u);
  ASSERT_EQ(batches[0].returns.size(), 9000u);
  double worst = 0;
  for (std::size_t k = 0; k < 9000; ++k) {
    const LaserReturn& r = batches[0].returns[k];
    const auto wire = static_cast<std::uint32_t>(0xFFFF0000u + 858'993u * k);
    const double angle = wire * (kTurn / 4294967296.0);
    worst = std::max({worst, std::abs(r.x - 100 * std::sin(angle)), std::abs(r.y - 100 * std::cos(angle))});
    EXPECT_GE(r.azimuth, 0);
    EXPECT_LT(r.azimuth, 6.2831853f);
    ASSERT_NEAR(r.azimuth, angle, 1e-6);
  }
  EXPECT_LT(worst, 1e-5);
  // A mirror that turns the other way has a negative step.
  d.step = -858'993;
  d.counter = 1;
  decoded.feed(d);
  EXPECT_NEAR(decoded.all<LaserBatch>()[1].returns[1000].x,
              100 * std::sin((0xFFFF0000u - 858'993'000u) * (kTurn / 4294967296.0)), 1e-4);
}

TEST(ProfileScanner, EachScaleOfSecondsIsHandedOnAsItIs) {
  // 2026-01-01T00:59:59.25 UTC is GPS second 1451264417 and Unix second 1767229199.
  ProfileDatagram gps = four_pulses(), utc = four_pulses(), none = four_pulses();
  gps.second = 1'451'264'417;
  utc.scale = 1;
  utc.second = 1'767'229'199;
  none.scale = 2;
  none.second = 7 * 3600 + 12;
  for (ProfileDatagram* d : {&gps, &utc, &none}) d->nanosecond = 250'000'001;
  utc.counter = 1;
  none.counter = 2;
  ProfileDecoded decoded;
  for (ProfileDatagram* d : {&gps, &utc, &none}) decoded.feed(*d);
  const auto batches = decoded.all<LaserBatch>();
  ASSERT_EQ(batches.size(), 3u);
  EXPECT_EQ(batches[0].time, LaserTime(gps_time_ns(1'451'264'417'250'000'001)));
  EXPECT_EQ(from_unix(std::get<UnixTime>(batches[1].time)), std::get<GpsTime>(batches[0].time));
  EXPECT_EQ(batches[2].time,
            LaserTime(LaserCounter{CounterOrigin::Own, seconds(4'294'967'296), nanoseconds(25'212'250'000'001)}));
}

TEST(ProfileScanner, StatusTellsOfPpsAndNamesTheEdgeOncePerSecond) {
  ProfileDecoded decoded;
  ProfileDatagram d = test::profile_status(0);
  d.second = d.edge_second = 1'451'264'417;
  for (unsigned i = 0; i < 10; ++i) {
    d.counter = i;
    d.nanosecond = i * 100'000'000;
    decoded.feed(d);
  }
  EXPECT_EQ(decoded.all<LaserStatus>().size(), 10u);
  EXPECT_EQ(decoded.all<LaserStatus>()[0].clock, SyncState::Locked);
  EXPECT_EQ(decoded.all<LaserStatus>()[0].words, "PPS locked, seconds named");
  auto labels = decoded.all<TimeLabel>();
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_EQ(labels[0].second, GpsTime(seconds(1'451'264'417)));
  EXPECT_TRUE(labels[0].is_valid);

  d.scale = 1;
  d.second = d.edge_second = 1'767'229'200;  // the next second
  d.nanosecond = 950'000'000;                // so late that another edge may have come before it arrives
  ++d.counter;
  decoded.feed(d);
  EXPECT_EQ(decoded.all<TimeLabel>().size(), 1u);
  d.nanosecond = 100'000'000;
  d.pps = 1;
  ++d.counter;
  decoded.feed(d);
  labels = decoded.all<TimeLabel>();
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_EQ(labels[1].second, GpsTime(seconds(1'451'264'418)));
  EXPECT_FALSE(labels[1].is_valid) << "not locked";
  d.flags = 0;
  d.second = ++d.edge_second;
  ++d.counter;
  decoded.feed(d);
  EXPECT_EQ(decoded.all<TimeLabel>().size(), 2u) << "nobody told it the second";
  EXPECT_TRUE(decoded.is_every_byte_counted());
}

TEST(ProfileScanner, WhatIsMissingLateOrDoubleIsToldOnce) {
  ProfileDecoded decoded;
  std::int64_t now = 0;
  const auto data = [&](std::uint32_t counter) {
    ProfileDatagram d = four_pulses();
    d.counter = counter;
    decoded.feed(d, now += 2'000'000'000);
  };
  // The counter wraps without a loss. Status datagrams have their own counter.
  for (const std::uint32_t counter : {0xFFFFFFFEu, 0xFFFFFFFFu, 0u, 1u}) data(counter);
  decoded.feed(test::profile_status(77), now);
  EXPECT_THAT(decoded.faults(), IsEmpty());
  data(5);
  data(3);
  data(3);
  data(6);
  EXPECT_EQ(decoded.all<LaserBatch>().size(), 7u);
  data(3'000'000'000);
  data(3'000'000'001);
  EXPECT_THAT(decoded.faults(),
              ElementsAre(HasSubstr("Lost 3: scanner 7: 3 data datagrams missing before number 5, line 3"),
                          HasSubstr("Late 1: scanner 7: data datagram 3"),
                          HasSubstr("Spurious 1: scanner 7: data datagram 3 came twice"),
                          HasSubstr("Lost 1: scanner 7: its count of data datagrams leapt to 3000000000")));
  EXPECT_EQ(decoded.decoder.counts().messages.at("data twice"), 1u);
  EXPECT_TRUE(decoded.is_every_byte_counted());
}

TEST(ProfileScanner, EachBrokenFieldIsNamed) {
  const auto said = [](ProfileDatagram d, std::size_t cut = 0) {
    ProfileDecoded decoded;
    test::Bytes bytes = d.bytes();
    bytes.resize(bytes.size() - cut);
    decoded.feed(bytes);
    EXPECT_TRUE(decoded.is_every_byte_counted());
    EXPECT_EQ(decoded.decoder.counts().malformed_bytes, bytes.size());
    EXPECT_EQ(decoded.out.size(), 1u);
    return decoded.faults().empty() ? std::string() : decoded.faults()[0];
  };
  const auto with = [&](auto change) {
    ProfileDatagram d = four_pulses();
    change(d);
    return said(d);
  };
  EXPECT_THAT(with([](auto& d) { d.magic = 1; }), HasSubstr("does not begin with PRF1"));
  EXPECT_THAT(with([](auto& d) { d.version = 2; }), HasSubstr("version 2"));
  EXPECT_THAT(with([](auto& d) { d.kind = 3; }), HasSubstr("kind 3"));
  EXPECT_THAT(with([](auto& d) { d.length = 20; }), HasSubstr("says 20 bytes"));
  EXPECT_THAT(said(four_pulses(), 1), HasSubstr("cut short: says 78 bytes, 77 came"));
  EXPECT_THAT(with([](auto& d) { d.scale = 3; }), HasSubstr("time scale 3"));
  EXPECT_THAT(with([](auto& d) { d.nanosecond = 1'000'000'000; }), HasSubstr("beyond the second"));
  EXPECT_THAT(with([](auto& d) { d.returns = 6; }), HasSubstr("4 pulses and 6 returns do not fill"));
  EXPECT_THAT(with([](auto& d) {
                d.period_ps = 4'000'000'000;
                d.pulses.assign(250, {});
              }),
              HasSubstr("last a second or more"));
  EXPECT_THAT(with([](auto& d) { d.pulses = {std::vector<test::ProfileShot>(16, {50'000})}; }),
              HasSubstr("16 returns; 15 is the most"));
  ProfileDatagram moved = four_pulses();
  test::Bytes bytes = moved.bytes();
  bytes[44] = std::byte{2};  // the first pulse claims a return more
  ProfileDecoded decoded;
  decoded.feed(bytes);
  EXPECT_THAT(decoded.faults()[0], HasSubstr("have 6 returns, but 5 follow"));
  EXPECT_THAT(said(test::profile_status(0), 1), HasSubstr("cut short"));
}

TEST(ProfileScanner, AnotherScannerOnTheSamePortIsNotMixedIn) {
  ProfileDecoded any, chosen({.scanner_id = 9});
  ProfileDatagram seven = four_pulses(), nine = four_pulses();
  nine.scanner = 9;
  for (ProfileDecoded* decoded : {&any, &chosen}) {
    decoded->feed(seven);
    decoded->feed(nine);
    EXPECT_EQ(decoded->all<LaserBatch>().size(), 1u);
    EXPECT_EQ(decoded->decoder.counts().ignored_bytes, seven.bytes().size());
    EXPECT_TRUE(decoded->is_every_byte_counted());
  }
  EXPECT_THAT(any.faults(), ElementsAre(HasSubstr("WrongDevice 1: datagram of scanner 9; this one is 7")));
  EXPECT_THAT(chosen.faults(), ElementsAre(HasSubstr("WrongDevice 1: datagram of scanner 7; this one is 9")));
}

TEST(ProfileScanner, RangesAndAnglesOutsideTheLimitsAreDropped) {
  // The window of angles goes through zero, and ranges from 5 to 15 m are kept.
  ProfileDecoded decoded({.min_range_m = 5, .max_range_m = 15, .angle_begin = kTurn * 7 / 8, .angle_end = kTurn / 8});
  ProfileDatagram d;
  d.step = 0x10000000;  // sixteen of a turn
  d.pulses.assign(16, {{49'999}, {50'000}, {150'000}, {150'001}});
  decoded.feed(d);
  const auto batches = decoded.all<LaserBatch>();
  ASSERT_EQ(batches.size(), 1u);
  ASSERT_EQ(batches[0].returns.size(), 2u * 5);
  for (const LaserReturn& r : batches[0].returns) {
    EXPECT_GT(r.y, 0);
    EXPECT_TRUE(r.return_number == 2 || r.return_number == 3);
    EXPECT_EQ(r.return_count, 4);
  }
}

TEST(ProfileScanner, ConfigIsChecked) {
  using Config = ProfileScannerDecoder::Config;
  EXPECT_EQ(Config{}.validate(), "");
  EXPECT_THAT(Config{.scanner_id = 65536}.validate(), HasSubstr("scanner_id"));
  EXPECT_THAT((Config{.min_range_m = 5, .max_range_m = 5}.validate()), HasSubstr("max_range_m"));
  EXPECT_THAT((Config{.angle_begin = 1, .angle_end = 1}.validate()), HasSubstr("angle_begin"));
  EXPECT_THAT(Config{.angle_end = 6.4}.validate(), HasSubstr("angle_end"));
}

}  // namespace
}  // namespace hueline::drivers
