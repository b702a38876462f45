#include "sim/wire/timeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "sim/wire/faults.hpp"
#include "sim/wire/novatel_encode.hpp"
#include "sim/wire/utc.hpp"
#include "tests/sim/recorded.hpp"
#include "tests/sim/short_drive.hpp"

namespace hueline::sim {
namespace {

using test::load;
using test::short_drive;

bool same(const WireEvent& a, const WireEvent& b) {
  return a.at_ns == b.at_ns && a.channel == b.channel && a.payload == b.payload && a.edge_ns == b.edge_ns &&
         a.sequence == b.sequence && a.camera_counter_ns == b.camera_counter_ns;
}

std::vector<WireEvent> of(const Timeline& timeline, WireChannel channel, unsigned log_id = 0) {
  std::vector<WireEvent> found;
  for (const WireEvent& e : timeline.events) {
    if (e.channel == channel && (log_id == 0 || peek_novatel(e.payload).id == log_id)) found.push_back(e);
  }
  return found;
}

TEST(Timeline, IsOrderedCompleteAndRepeatable) {
  const Drive drive = short_drive(3);
  const auto timeline = build_timeline(drive, {});
  ASSERT_TRUE(timeline.ok());
  EXPECT_TRUE(std::is_sorted(timeline->events.begin(), timeline->events.end(),
                             [](const WireEvent& a, const WireEvent& b) { return a.at_ns < b.at_ns; }));
  EXPECT_EQ(of(*timeline, WireChannel::LaserData).size(), drive.laser.size());
  EXPECT_EQ(of(*timeline, WireChannel::LaserPosition).size(), 30U);
  EXPECT_EQ(of(*timeline, WireChannel::Camera).size(), drive.exposures.size());
  EXPECT_EQ(of(*timeline, WireChannel::Pps).size(), 3U);
  EXPECT_EQ(of(*timeline, WireChannel::Pos, 508).size(), drive.ins.size());
  EXPECT_EQ(of(*timeline, WireChannel::Pos, 1130).size(), drive.exposures.size());
  EXPECT_EQ(of(*timeline, WireChannel::Pos, 101).size(), 3U);

  const auto again = build_timeline(drive, {});
  EXPECT_TRUE(
      std::equal(timeline->events.begin(), timeline->events.end(), again->events.begin(), again->events.end(), same));
  TimelineConfig other;
  other.seed = 2;
  EXPECT_FALSE(
      std::equal(timeline->events.begin(), timeline->events.end(), build_timeline(drive, other)->events.begin(), same));
}

/// Returns the root mean square of MARK1TIME minus the true strobe, us.
double mark_error_us(const Drive& drive, const TimelineConfig& config) {
  const Timeline timeline = *build_timeline(drive, config);
  const auto marks = of(timeline, WireChannel::Pos, 1130);
  double sum = 0;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    double seconds = 0;  // of the week; stands after the header of 28 bytes and the week
    std::memcpy(&seconds, marks[i].payload.data() + 32, sizeof seconds);
    const GpsNs in_week = drive.exposures[i].exposure_start_gps_ns % (604'800 * std::int64_t{1'000'000'000});
    sum += std::pow(seconds * 1e6 - static_cast<double>(in_week) * 1e-3, 2);
  }
  return std::sqrt(sum / static_cast<double>(marks.size()));
}

TEST(Timeline, MarksErrByTheStrobesJitterAndNotWithoutIt) {
  Drive drive = short_drive(3);
  const CameraExposure one = drive.exposures.front();
  drive.exposures.clear();
  for (std::uint32_t i = 0; i < 200; ++i) {
    drive.exposures.push_back(one);
    drive.exposures.back().number = i;
    drive.exposures.back().exposure_start_gps_ns += 10'000'000 * std::int64_t{i};
  }
  TimelineConfig config;
  EXPECT_LT(mark_error_us(drive, config), 0.001);
  config.strobe_jitter_ns = 700;
  EXPECT_NEAR(mark_error_us(drive, config), 0.7, 0.15);
  config.strobe_jitter_ns = -1;
  EXPECT_THAT(build_timeline(drive, config).error().message, testing::HasSubstr("strobe_jitter_ns"));
}

TEST(Timeline, NothingLeavesADeviceBeforeItHappened) {
  const Drive drive = short_drive(3);
  const Timeline timeline = *build_timeline(drive, {});
  const auto expect_latency = [&](std::int64_t at, GpsNs event, std::int64_t least, std::int64_t most) {
    EXPECT_GE(at - (event - drive.begin_gps_ns), least);
    EXPECT_LE(at - (event - drive.begin_gps_ns), most);
  };
  const auto lasers = of(timeline, WireChannel::LaserData);
  for (std::size_t i = 0; i < lasers.size(); ++i) {
    // The last firing is 23 sequences and 15 firings after the first.
    expect_latency(lasers[i].at_ns, drive.laser[i].first_firing_gps_ns + 1'306'368, 20'000, 60'000);
  }
  const auto solutions = of(timeline, WireChannel::Pos, 508);
  for (std::size_t i = 0; i < solutions.size(); ++i) {
    EXPECT_EQ(peek_novatel(solutions[i].payload).milliseconds, drive.ins[i].gps_ns / 1'000'000 % 604'800'000);
    expect_latency(solutions[i].at_ns, drive.ins[i].gps_ns, 3'000'000, 10'000'000);
  }
  const auto images = of(timeline, WireChannel::Camera);
  for (std::size_t i = 0; i < images.size(); ++i) {
    EXPECT_EQ(images[i].sequence, i);
    const GpsNs end = drive.exposures[i].exposure_start_gps_ns + 2'000'000;
    expect_latency(images[i].at_ns, end, 25'000'000, 35'000'000);
    const double latched = static_cast<double>(end + 45'000 - drive.begin_gps_ns) * (1 + 12e-6);
    EXPECT_NEAR(static_cast<double>(images[i].camera_counter_ns - 1'000'000'000'000), latched, 8'001);
  }
}

TEST(Timeline, PpsEdgesAreTheWholeSecondsWithTheirErrors) {
  const Timeline timeline = *build_timeline(short_drive(3), {});
  const auto edges = of(timeline, WireChannel::Pps);
  ASSERT_EQ(edges.size(), 3U);  // the drive began a quarter of a second after a full second
  EXPECT_EQ(edges[0].edge_ns, 750'000'000 + 40);
  EXPECT_EQ(edges[1].edge_ns, 1'750'000'000 - 70);
  EXPECT_EQ(edges[0].sequence, 1U);
  EXPECT_EQ(edges[2].sequence, 3U);
}

TEST(Timeline, PositionPacketsCarryTheLastSecondThatCouldHaveArrived) {
  const Timeline timeline = *build_timeline(short_drive(3), {});
  int with_hour = 0;
  for (const WireEvent& e : of(timeline, WireChannel::LaserPosition)) {
    std::string text;
    for (std::size_t at = 206; at < 334 && e.payload[at] != std::byte{0}; ++at)
      text += static_cast<char>(e.payload[at]);
    if (e.at_ns < 950'000'000) {
      EXPECT_EQ(text, "");
    }
    if (e.at_ns >= 1'150'000'000 && e.at_ns < 1'950'000'000) {
      EXPECT_THAT(text, testing::StartsWith("$GPRMC,125959.00,A,"));
    }
    if (e.at_ns >= 2'150'000'000 && e.at_ns < 2'950'000'000) {
      EXPECT_THAT(text, testing::HasSubstr("$GPRMC,130000.00,A,"));
      EXPECT_THAT(text, testing::HasSubstr(",19.438,0.0,050324,"));  // 10 m/s due north
      ++with_hour;
    }
    EXPECT_EQ(load<std::uint32_t>(e.payload, 198), (3'598'250'000LL + e.at_ns / 1000) % 3'600'000'000LL);
  }
  EXPECT_GE(with_hour, 7);
}

TEST(Timeline, ASecondScannerComesBesideTheFirst) {
  Drive drive;
  drive.begin_gps_ns = 1'400'000'000LL * kNsPerSecond;
  drive.end_gps_ns = drive.begin_gps_ns + kNsPerSecond;
  for (int i = 0; i < 20; ++i) {
    ProfilePacket packet;
    packet.first_pulse_gps_ns = drive.begin_gps_ns + i * 50'000'000LL;
    packet.period_ps = 1'000'000;
    packet.counts = {1, 0};
    packet.range_100um = {50'000};
    packet.reflectance_1e4 = {4000};
    drive.profile.push_back(packet);
  }
  const Result<Timeline> alone = build_timeline(drive, {});
  TimelineConfig config;
  config.seed = 2;
  config.laser = 1;
  Result<Timeline> second = build_timeline(drive, config);
  ASSERT_TRUE(alone.ok() && second.ok());
  Timeline both = *alone;
  add_laser_of(both, std::move(*second));

  std::array<std::size_t, 2> datagrams{};
  std::size_t others = 0, others_alone = 0;
  for (const WireEvent& event : both.events) {
    if (event.channel != WireChannel::LaserData && event.channel != WireChannel::LaserPosition) {
      ++others;
      continue;
    }
    ASSERT_LT(event.laser, 2);
    ++datagrams[event.laser];
    // The scanner's number (u16 at 6) distinguishes scanners for a receiver, even on one port.
    EXPECT_EQ(std::to_integer<int>(event.payload[6]), event.laser + 1);
  }
  for (const WireEvent& event : alone->events)
    others_alone += event.channel != WireChannel::LaserData && event.channel != WireChannel::LaserPosition;
  EXPECT_EQ(datagrams[0], 30u);  // 20 of data and 10 of status
  EXPECT_EQ(datagrams[1], 30u);
  EXPECT_EQ(others, others_alone);
  EXPECT_TRUE(std::is_sorted(both.events.begin(), both.events.end(),
                             [](const auto& a, const auto& b) { return a.at_ns < b.at_ns; }));
}

TEST(Timeline, RefusesUnusableInput) {
  Drive drive = short_drive(1);
  TimelineConfig config;
  config.ins = {5, 4};
  EXPECT_THAT(build_timeline(drive, config).error().message, testing::HasSubstr("ins"));
  std::swap(drive.laser[0], drive.laser[5]);
  EXPECT_EQ(build_timeline(drive, {}).error().code, ErrorCode::Invalid);
  drive.end_gps_ns = drive.begin_gps_ns;
  EXPECT_EQ(build_timeline(drive, {}).error().code, ErrorCode::Invalid);
}

TEST(WireFaults, EachKindDoesWhatItSays) {
  const Timeline clean = *build_timeline(short_drive(3), {});
  const auto damaged = [&](FaultRule rule, std::size_t expected_hits) {
    Timeline t = clean;
    const auto hits = apply_faults(t, {rule}, 7);
    EXPECT_TRUE(hits.ok());
    EXPECT_EQ(hits->at(0), expected_hits);
    return t;
  };
  FaultRule rule;
  rule.channel = WireChannel::Camera;
  rule.begin_ns = 500'000'000;
  rule.end_ns = 1'000'000'000;
  const auto lost = of(damaged(rule, 1), WireChannel::Camera);
  ASSERT_EQ(lost.size(), 5U);
  EXPECT_EQ(lost[1].sequence, 2U);  // the camera counted it
  rule.fault = WireFault::Miss;
  EXPECT_EQ(of(damaged(rule, 1), WireChannel::Camera)[1].sequence, 1U);
  rule.fault = WireFault::Duplicate;
  EXPECT_EQ(of(damaged(rule, 1), WireChannel::Camera).size(), 7U);

  FaultRule crc;
  crc.fault = WireFault::Corrupt;
  crc.channel = WireChannel::Pos;
  crc.log_id = 1130;
  int broken = 0;
  for (const WireEvent& e : of(damaged(crc, 6), WireChannel::Pos)) {
    const std::size_t body = e.payload.size() - 4;
    if (novatel_crc32(std::span(e.payload).first(body)) != load<std::uint32_t>(e.payload, body)) ++broken;
  }
  EXPECT_EQ(broken, 6);

  FaultRule late;
  late.fault = WireFault::Delay;
  late.channel = WireChannel::Pos;
  late.log_id = 101;
  late.delay_ns = 900'000'000;
  const Timeline t = damaged(late, 3);
  EXPECT_TRUE(std::is_sorted(t.events.begin(), t.events.end(),
                             [](const WireEvent& a, const WireEvent& b) { return a.at_ns < b.at_ns; }));
  EXPECT_EQ(of(t, WireChannel::Pos, 101)[0].at_ns, of(clean, WireChannel::Pos, 101)[0].at_ns + 900'000'000);
}

TEST(WireFaults, ProbabilityIsAShareAndTheSeedDecidesWhich) {
  const Timeline clean = *build_timeline(short_drive(3), {});
  FaultRule rule;
  rule.probability = 0.1;
  Timeline a = clean, b = clean, c = clean;
  const std::size_t hits = apply_faults(a, {rule}, 1)->at(0);
  EXPECT_NEAR(static_cast<double>(hits), 0.1 * 2260, 60);
  (void)apply_faults(b, {rule}, 1);
  (void)apply_faults(c, {rule}, 2);
  EXPECT_TRUE(std::equal(a.events.begin(), a.events.end(), b.events.begin(), b.events.end(), same));
  EXPECT_FALSE(std::equal(a.events.begin(), a.events.end(), c.events.begin(), c.events.end(), same));
  rule.probability = 1.5;
  EXPECT_EQ(apply_faults(a, {rule}, 1).error().code, ErrorCode::Invalid);
}

}  // namespace
}  // namespace hueline::sim
