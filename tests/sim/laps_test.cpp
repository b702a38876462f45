#include "sim/laps.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "sim/earth.hpp"
#include "sim/scenario.hpp"
#include "sim/vec3.hpp"
#include "tests/sim/short_drive.hpp"

namespace hueline::sim {
namespace {

constexpr std::uint32_t kLaps = 3;
constexpr std::int64_t kSecondNs = 1'000'000'000, kLapNs = 2 * kSecondNs;

/// Laser and camera run for two seconds, a second after the POS and a second before it ends.
Scenario scenario() {
  Scenario out;
  out.lead_in_s = 1;
  out.duration_s = 2;
  return out;
}

/// A vehicle that moves north by 0.1 m from one solution to the next, with two kinds of scanner, wheels, and a camera
/// that has no image for the last half second.
Drive vehicle() {
  Drive drive = test::short_drive(4);
  const GpsNs begin = scenario().begin_gps_ns();
  const auto later = [&](auto& items, auto time) {
    for (auto& item : items) item.*time += begin - test::kBegin;
  };
  later(drive.ins, &InsSample::gps_ns);
  later(drive.laser, &LaserPacket::first_firing_gps_ns);
  later(drive.exposures, &CameraExposure::exposure_start_gps_ns);
  drive.begin_gps_ns = begin;
  drive.end_gps_ns = begin + 4 * kSecondNs;
  for (std::size_t i = 0; i < drive.ins.size(); ++i) drive.ins[i].latitude_rad += 1.6e-8 * static_cast<double>(i);
  // The exposure at 2.6 s is missing.
  std::erase_if(drive.exposures,
                [&](const CameraExposure& e) { return e.exposure_start_gps_ns - begin == 2'600'000'000; });
  for (std::size_t i = 0; i < drive.exposures.size(); ++i) drive.exposures[i].image_file = std::to_string(i);
  for (std::uint32_t line = 0; line < 20; ++line) {
    ProfilePacket packet;
    packet.first_pulse_gps_ns = begin + kSecondNs + line * (kLapNs / 20);
    packet.line = line;
    packet.period_ps = 1'000'000;
    packet.counts.assign(20, 1);
    packet.range_100um.assign(20, 50'000 + line);
    packet.reflectance_1e4.assign(20, 5000);
    drive.profile.push_back(packet);
  }
  for (std::uint32_t i = 1; i <= 400; ++i) {
    WheelSample sample;
    sample.gps_ns = begin + i * 10'000'000LL - 1;
    sample.pulses = {i, 2 * i};
    drive.wheel.push_back(sample);
  }
  return drive;
}

Laps laps_of(const Drive& drive) {
  return {kLaps, [&drive](std::uint32_t number) {
            const Lap lap = lap_of(scenario(), drive, number, kLaps);
            TimelineConfig config;
            config.before = lap.before;
            return build_timeline(lap.drive, config);
          }};
}

std::vector<WireEvent> events_of(Laps laps) {
  std::vector<WireEvent> events;
  for (auto lap = *laps.next(); lap != nullptr; lap = *laps.next())
    events.insert(events.end(), lap->events.begin(), lap->events.end());
  return events;
}

std::vector<const WireEvent*> of(const std::vector<WireEvent>& events, WireChannel channel) {
  std::vector<const WireEvent*> out;
  for (const WireEvent& event : events)
    if (event.channel == channel) out.push_back(&event);
  return out;
}

/// Returns the laps as one drive, as they would have been simulated in one.
Drive joined(const Drive& drive) {
  Drive whole = lap_of(scenario(), drive, 0, kLaps).drive;
  for (std::uint32_t lap = 1; lap < kLaps; ++lap) {
    const Drive next = lap_of(scenario(), drive, lap, kLaps).drive;
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(whole.ins, next.ins);
    append(whole.laser, next.laser);
    append(whole.profile, next.profile);
    append(whole.wheel, next.wheel);
    append(whole.exposures, next.exposures);
    whole.end_gps_ns = next.end_gps_ns;
  }
  return whole;
}

TEST(Laps, SendWhatOneLongDriveWouldSend) {
  const Drive drive = vehicle();
  const std::vector<WireEvent> events = events_of(laps_of(drive));
  const Timeline whole = *build_timeline(joined(drive), {});
  for (const WireChannel channel : {WireChannel::LaserData, WireChannel::Wheel, WireChannel::Pos}) {
    // Latencies are other ones in another lap, so that the order of two kinds of datagrams or logs differs.
    std::multiset<Bytes> sent, expected;
    for (const WireEvent* event : of(events, channel)) sent.insert(event->payload);
    for (const WireEvent* event : of(whole.events, channel)) expected.insert(event->payload);
    EXPECT_EQ(sent.size(), expected.size()) << name(channel);
    std::vector<Bytes> others;
    std::set_difference(sent.begin(), sent.end(), expected.begin(), expected.end(), std::back_inserter(others));
    // The place at a second or a mark is between two solutions, which a lap's last one has only in the long drive.
    EXPECT_LE(others.size(), channel == WireChannel::Pos ? kLaps : 0) << name(channel);
  }
}

TEST(Laps, CountOn) {
  const std::vector<WireEvent> events = events_of(laps_of(vehicle()));
  const auto pulses = of(events, WireChannel::Pps);
  ASSERT_EQ(pulses.size(), 2 + 2 * kLaps);
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    EXPECT_EQ(pulses[i]->sequence, i + 1);
    EXPECT_NEAR(static_cast<double>(pulses[i]->edge_ns), 1e9 * static_cast<double>(i), 100);
  }
  const auto images = of(events, WireChannel::Camera);
  ASSERT_EQ(images.size(), kLaps * 4);
  for (std::size_t i = 0; i < images.size(); ++i) {
    EXPECT_EQ(images[i]->sequence, i);
    if (i > 0)
      EXPECT_NEAR(static_cast<double>(images[i]->camera_counter_ns - images[i - 1]->camera_counter_ns),
                  500e6 * 1.000012, 17'000);
  }
  const auto data = of(events, WireChannel::LaserPosition);
  EXPECT_EQ(data.size(), 2 * (2 + 2 * kLaps) * 10);  // both scanners, ten times a second
}

TEST(Laps, AreInTheOrderOfTimeAcrossTheirEnds) {
  const Drive drive = vehicle();
  Laps laps = laps_of(drive);
  std::int64_t before = 0, end = 0;
  std::uint32_t laps_seen = 0;
  for (auto lap = *laps.next(); lap != nullptr; lap = *laps.next(), ++laps_seen) {
    EXPECT_GE(lap->events.front().at_ns, end);
    EXPECT_EQ(lap->begin_gps_ns, drive.begin_gps_ns);
    for (const WireEvent& event : lap->events) {
      EXPECT_GE(event.at_ns, before);
      before = event.at_ns;
    }
    end = lap->end_ns;
    EXPECT_EQ(end, kSecondNs + (laps_seen + 1) * kLapNs + (laps_seen + 1 == kLaps ? kSecondNs : 0));
  }
  EXPECT_EQ(laps_seen, kLaps);
}

TEST(Laps, BeginWhereTheOneBeforeEnded) {
  const Drive drive = vehicle();
  for (std::uint32_t lap = 1; lap < kLaps; ++lap) {
    const InsSample last = lap_of(scenario(), drive, lap - 1, kLaps).drive.ins.back(),
                    first = lap_of(scenario(), drive, lap, kLaps).drive.ins.front();
    EXPECT_EQ(first.gps_ns - last.gps_ns, 10'000'000);
    EXPECT_NEAR(first.latitude_rad - last.latitude_rad, 1.6e-8, 1e-13);
    EXPECT_NEAR(first.longitude_rad, last.longitude_rad, 1e-13);
  }
}

TEST(Laps, GoOnAroundABend) {
  // On a circle of 20 m, at 10 m/s and to the right; the vehicle heads along it.
  constexpr double kRadius = 20, kTurn_rad_s = 0.5;
  Drive drive = vehicle();
  const double latitude = drive.ins.front().latitude_rad, longitude = drive.ins.front().longitude_rad;
  const GeodeticPlace origin{latitude, longitude, 0};
  const auto ecef_of = [](const InsSample& sample) {
    return ecef_from_geodetic({sample.latitude_rad, sample.longitude_rad, sample.ellipsoidal_height_m});
  };
  for (InsSample& sample : drive.ins) {
    const double turned = 1e-9 * static_cast<double>(sample.gps_ns - drive.begin_gps_ns) * kTurn_rad_s;
    const GeodeticPlace place =
        geodetic_from_ecef(ecef_from_geodetic(origin) +
                           R_ecef_enu(origin) * Vec3{kRadius * (1 - std::cos(turned)), kRadius * std::sin(turned), 0});
    sample.latitude_rad = place.latitude;
    sample.longitude_rad = place.longitude;
    sample.ellipsoidal_height_m = place.height;
    sample.heading_rad = turned;
    sample.velocity_east = 10 * std::sin(turned);
    sample.velocity_north = 10 * std::cos(turned);
  }
  for (const InsSample& sample : joined(drive).ins) {
    const double turned = 1e-9 * static_cast<double>(sample.gps_ns - drive.begin_gps_ns) * kTurn_rad_s;
    const Vec3 place = transposed(R_ecef_enu(origin)) * (ecef_of(sample) - ecef_from_geodetic(origin));
    EXPECT_NEAR(place.x, kRadius * (1 - std::cos(turned)), 1e-3);
    EXPECT_NEAR(place.y, kRadius * std::sin(turned), 1e-3);
    EXPECT_NEAR(std::remainder(sample.heading_rad - turned, 2 * kPi), 0, 1e-9);
    EXPECT_NEAR(sample.velocity_east, 10 * std::sin(turned), 1e-3);
    EXPECT_NEAR(sample.velocity_north, 10 * std::cos(turned), 1e-3);
  }
}

TEST(Laps, SendTheFirstImagesAgainWhereTheyHaveNoneLeft) {
  const std::vector<WireEvent> events = events_of(laps_of(vehicle()));
  std::vector<std::string> files;
  for (const WireEvent* event : of(events, WireChannel::Camera)) files.push_back(event->image_file);
  EXPECT_THAT(files, testing::ElementsAre("2", "3", "4", "2", "2", "3", "4", "2", "2", "3", "4", "2"));
}

TEST(Laps, LeaveOutTheDatagramThatTheNextLapSendsToo) {
  const Drive driven = lap_of(scenario(), vehicle(), 0, kLaps).drive;
  const GpsNs end = scenario().sensors_end_gps_ns();
  EXPECT_LE(driven.laser.back().first_firing_gps_ns, end - 1'327'104);
  EXPECT_GT(driven.laser.back().first_firing_gps_ns, end - 2 * 1'327'104);
  EXPECT_EQ(driven.profile.size(), 20U);
}

TEST(Laps, SayWhatCannotBeDrivenAgain) {
  Scenario other = scenario();
  EXPECT_EQ(cannot_be_driven_again(other), "");
  other.duration_s = 1.5;
  EXPECT_THAT(cannot_be_driven_again(other), testing::HasSubstr("duration_s"));
  other.faults.emplace_back();
  EXPECT_THAT(cannot_be_driven_again(other), testing::HasSubstr("faults"));
}

}  // namespace
}  // namespace hueline::sim
