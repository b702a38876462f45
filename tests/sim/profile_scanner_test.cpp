// Each point is computed again from the numbers on the wire and the true pose only.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/faults/faulty_timeline.hpp"
#include "sim/generate.hpp"
#include "sim/rig_truth.hpp"
#include "sim/truth_file.hpp"
#include "sim/vehicle.hpp"
#include "tests/sim/small_scenario.hpp"

namespace hueline::sim {
namespace {

Scenario profile_scenario() {
  Scenario s = small_scenario();
  s.noise = false;
  s.laser.model = LaserModel::Profile;
  s.laser.lines_per_s = 110;
  s.laser.points_per_s = 70'000;  // the period and the step are no round numbers
  s.laser.mount = {.x_m = 0.1, .y_m = -1.2, .z_m = 1.9, .rot_x_deg = -90, .rot_y_deg = 1, .rot_z_deg = 35};
  return s;
}

TEST(ProfileScanner, PacketsAreExactButForTheWire) {
  const TemporaryFolder folder("hueline-profile");
  const Scenario scenario = profile_scenario();
  const auto drive = generate(scenario, folder.path());
  ASSERT_TRUE(drive.ok()) << drive.error().message;
  EXPECT_TRUE(drive->laser.empty());
  ASSERT_EQ(drive->profile.size(), 274u);  // 70 000 pulses a second for 0.8 s, 204 in a packet
  auto reader = TruthReader::open(drive->cache_dir + "/truth.bin");
  ASSERT_TRUE(reader.ok());
  const Motion motion(scenario);
  const RigTruth rig = rig_truth(scenario);
  double worst = 0, worst_range = 0, lowest = 1e9;
  std::size_t returns = 0;
  std::uint32_t last_line = 0;
  for (const ProfilePacket& p : drive->profile) {
    const auto truth = reader->next_packet();
    ASSERT_TRUE(truth.ok());
    ASSERT_EQ(truth->size(), p.range_100um.size());
    ASSERT_EQ(p.counts.size(), 204u);
    last_line = p.line;
    std::size_t next = 0;
    for (std::size_t k = 0; k < p.counts.size(); ++k) {
      if (p.counts[k] == 0) continue;
      const TrueReturn& t = (*truth)[next];
      const double after_ns = static_cast<double>(k) * p.period_ps * 1e-3;
      // Stamp, offset and true time are each rounded to a nanosecond.
      ASSERT_LE(std::abs(static_cast<double>(t.fired_gps_ns - p.first_pulse_gps_ns) - after_ns), 1.5);
      const double angle =
          static_cast<std::uint32_t>(p.angle + k * static_cast<std::uint32_t>(p.angle_step)) * (2 * kPi / 4294967296.0);
      const Vec3 beam{1e-4 * p.range_100um[next] * std::sin(angle), 1e-4 * p.range_100um[next] * std::cos(angle), 0};
      const Vec3 place = motion.T_enu_body(t.fired_gps_ns) * (rig.T_body_scanner * beam);
      worst = std::max(worst, length(place - Vec3{t.beam_east, t.beam_north, t.beam_up}));
      worst_range = std::max(worst_range, length(Vec3{t.east - t.beam_east, t.north - t.beam_north, t.up - t.beam_up}));
      lowest = std::min(lowest, t.up);
      ++next;
    }
    returns += next;
  }
  EXPECT_GT(returns, 20'000u);
  EXPECT_EQ(last_line, 87u) << "0.8 s of 110 lines a second";
  EXPECT_LT(worst, 2e-6);
  EXPECT_LT(worst_range, 0.5e-4 + 2e-6);
  EXPECT_GT(lowest, -2.0) << "below the road: the mirror's plane is not where it should be";
}

TEST(ProfileScanner, TheMirrorsAxisLiesAlongTheDrivingDirectionAndAngleZeroIsDown) {
  Scenario s = profile_scenario();
  s.laser.mount.rot_y_deg = s.laser.mount.rot_z_deg = 0;
  const Pose T = rig_truth(s).T_body_scanner;
  EXPECT_NEAR((T.R * Vec3{0, 0, 1}).y, 1, 1e-12);
  EXPECT_NEAR((T.R * Vec3{0, 1, 0}).z, -1, 1e-12);
}

TEST(ProfileScanner, EveryFaultCanBeDoneToItsDatagrams) {
  Scenario scenario = profile_scenario();
  scenario.start_time_of_week_s = 3600 + 18 - 2;  // a UTC hour begins after two seconds
  Drive drive;
  drive.begin_gps_ns = scenario.begin_gps_ns();
  drive.end_gps_ns = drive.begin_gps_ns + 3'000'000'000;
  for (GpsNs t = drive.begin_gps_ns; t < drive.end_gps_ns; t += 5'000'000)
    drive.profile.push_back({t, 0, 0, 1000, 5'000'000, std::vector<std::uint8_t>(200, 1),
                             std::vector<std::uint32_t>(200, 50'000), std::vector<std::uint16_t>(200, 5'000)});
  const auto quiet = scenario_timeline(scenario, drive);
  ASSERT_TRUE(quiet.ok()) << quiet.error().message;
  std::size_t data = 0, status = 0;
  for (const WireEvent& event : quiet->timeline.events) {
    data += event.channel == WireChannel::LaserData && event.payload.size() == 44 + 200 * 7;
    status += event.channel == WireChannel::LaserPosition && event.payload.size() == 32;
  }
  EXPECT_EQ(data, drive.profile.size());
  EXPECT_EQ(status, 30u);
  for (const FaultEntry& entry : fault_registry()) {
    scenario.faults = {FaultLine::usual(entry.type, 1, 2)};
    const auto spoilt = scenario_timeline(scenario, drive);
    ASSERT_TRUE(spoilt.ok()) << entry.name << ": " << spoilt.error().message;
    if (entry.type == FaultType::HourWrapLate) {
      EXPECT_EQ(spoilt->hits[0], 0u) << "it has no counter of the hour";
    }
    if (entry.type == FaultType::PacketLoss) {
      EXPECT_GT(spoilt->hits[0], 15u);
    }
  }
}

TEST(ProfileScanner, OtherScannersKeepTheirFingerprint) {
  Scenario plain = small_scenario(), named = small_scenario();
  EXPECT_EQ(plain.text().find("lines_per_s"), std::string::npos);
  named.laser.lines_per_s = 100;
  EXPECT_NE(plain.fingerprint(), named.fingerprint());
}

}  // namespace
}  // namespace hueline::sim
