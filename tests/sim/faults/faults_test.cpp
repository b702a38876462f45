// The registry of faults, and what its lines do to a timeline compared with the timeline without them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "sim/faults/clock_truth.hpp"
#include "sim/faults/faulty_disk.hpp"
#include "sim/faults/faulty_timeline.hpp"
#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr GpsNs kBegin = (2381LL * 604800 + 302397) * kNsPerSecond;

/// A drive of six seconds on the spot with 100 solutions, 200 packets and ten exposures a second.
Drive drive() {
  Drive d;
  d.begin_gps_ns = kBegin;
  d.end_gps_ns = kBegin + 6 * kNsPerSecond;
  for (GpsNs t = kBegin; t <= d.end_gps_ns; t += 10'000'000) {
    InsSample s;
    s.gps_ns = t;
    s.latitude_rad = 0.84;
    s.sigma.fill(0.01);
    d.ins.push_back(s);
  }
  for (GpsNs t = kBegin; t < d.end_gps_ns; t += 5'000'000)
    d.laser.push_back({t, {}, std::vector<std::uint16_t>(384, 500), std::vector<std::uint8_t>(384, 9)});
  for (std::uint32_t i = 0; i < 58; ++i)
    d.exposures.push_back({i, kBegin + 50'000'137 + i * 100'000'000LL, 2'000'000, 8, 8, "images/" + std::to_string(i)});
  for (std::uint32_t i = 0; i < 300; ++i) d.wheel.push_back({kBegin + i * 20'000'000LL, {3, 3, 3, 3}, {i * 4, i * 4}});
  d.pps_edge_error_ns.assign(7, 0);
  return d;
}

bool same(const WireEvent& a, const WireEvent& b) {
  return a.at_ns == b.at_ns && a.channel == b.channel && a.payload == b.payload && a.edge_ns == b.edge_ns &&
         a.sequence == b.sequence && a.camera_counter_ns == b.camera_counter_ns && a.image_file == b.image_file &&
         a.height == b.height && a.missing_packets == b.missing_packets && a.piece_bytes == b.piece_bytes;
}
bool same(const Timeline& a, const Timeline& b) {
  return std::equal(a.events.begin(), a.events.end(), b.events.begin(), b.events.end(),
                    [](const auto& x, const auto& y) { return same(x, y); });
}
std::size_t count(const Timeline& t, WireChannel channel, std::uint16_t log = 0) {
  return static_cast<std::size_t>(std::count_if(t.events.begin(), t.events.end(), [&](const WireEvent& e) {
    return e.channel == channel && (log == 0 || e.log.id == log);
  }));
}

TEST(FaultRegistry, NamesEachFaultOnceInTheOrderOfItsType) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < fault_registry().size(); ++i) {
    const FaultEntry& entry = fault_registry()[i];
    EXPECT_EQ(static_cast<std::size_t>(entry.type), i) << entry.name;
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_EQ(find_fault(entry.name), &entry);
    EXPECT_GT(entry.targets.size(), 0u) << entry.name;
    EXPECT_EQ(entry.told.size() > 0, entry.outcome == FaultOutcome::Told) << entry.name;
    EXPECT_EQ(FaultLine::usual(entry.type, 1, 1).validate(), "") << entry.name;
    FaultLine strong = FaultLine::usual(entry.type, 1, 1);
    strong.strength = entry.most + 1;
    EXPECT_NE(strong.validate(), "") << entry.name;
  }
  EXPECT_GE(names.size(), 40u);
  EXPECT_EQ(find_fault("no_such_fault"), nullptr);
}

/// Returns the offset of `clock` at the sample nearest to `seconds` of the drive.
ClockSample at(const std::vector<ClockSample>& samples, VehicleClock clock, double seconds) {
  ClockSample best;
  double nearest = 1e9;
  for (const ClockSample& s : samples) {
    const double off = std::abs(static_cast<double>(s.gps_ns - kBegin) * 1e-9 - seconds);
    if (s.clock != clock || off >= nearest) continue;
    nearest = off;
    best = s;
  }
  EXPECT_LT(nearest, 0.11) << name(clock);
  return best;
}

TEST(ClockTruth, ClocksWithoutFaultsAreRightAndTheCamerasDriftsAsConfigured) {
  const TimelineConfig config;
  const auto built = build_faulty_timeline(drive(), config, {});
  ASSERT_TRUE(built.ok());
  const auto samples = true_clocks(built->timeline, {});
  std::size_t of_camera = 0;
  for (const ClockSample& s : samples) {
    if (s.clock != VehicleClock::Camera) {
      EXPECT_EQ(s.offset_ns, 0) << name(s.clock);
      EXPECT_EQ(s.rate_ppb, 0) << name(s.clock);
      continue;
    }
    ++of_camera;
    EXPECT_NEAR(s.rate_ppb, config.camera_drift_ppb, 15);  // offsets are whole ns, 0.1 s apart
    EXPECT_NEAR(static_cast<double>(s.offset_ns - config.camera_counter_origin_ns),
                config.camera_drift_ppb * 1e-9 * static_cast<double>(s.gps_ns - kBegin), 1);
  }
  EXPECT_EQ(of_camera, 58u);
}

TEST(ClockTruth, StepsAndDriftsOfFaultsAreInIt) {
  std::vector<FaultLine> lines;
  const auto add = [&](FaultType type, double at_s, double for_s, double strength) -> FaultLine& {
    lines.push_back(FaultLine::usual(type, at_s, for_s));
    lines.back().strength = strength;
    return lines.back();
  };
  add(FaultType::CameraClockStep, 2, 1, 0.25);
  add(FaultType::LaserClockStep, 3, 1, 0.5);
  add(FaultType::HostClockStep, 4, 1, 1.5);
  const auto built = build_faulty_timeline(drive(), {}, lines);
  ASSERT_TRUE(built.ok()) << built.error().message;
  const auto samples = true_clocks(built->timeline, lines);
  const auto before = at(samples, VehicleClock::Camera, 1.5).offset_ns,
             after = at(samples, VehicleClock::Camera, 5).offset_ns;
  EXPECT_NEAR(static_cast<double>(after - before), 0.25e9, 12e-6 * 3.6e9);
  EXPECT_EQ(at(samples, VehicleClock::Scanner, 2.9).offset_ns, 0);
  EXPECT_EQ(at(samples, VehicleClock::Scanner, 3.5).offset_ns, 500'000'000);
  EXPECT_EQ(at(samples, VehicleClock::Host, 3.9).offset_ns, 0);
  EXPECT_EQ(at(samples, VehicleClock::Host, 5.5).offset_ns, 1'500'000'000);
  EXPECT_EQ(at(samples, VehicleClock::Receiver, 5.5).offset_ns, 0);

  lines.clear();
  add(FaultType::HostClockDrift, 1, 2, 40);  // grows to 40 us/s within two seconds and stays
  const auto drifting = build_faulty_timeline(drive(), {}, lines);
  ASSERT_TRUE(drifting.ok());
  const auto host = true_clocks(drifting->timeline, lines);
  // half of the growth; a rate is that of the 0.1 s before
  EXPECT_NEAR(at(host, VehicleClock::Host, 2.0).rate_ppb, 20'000, 1'100);
  EXPECT_NEAR(at(host, VehicleClock::Host, 5.0).rate_ppb, 40'000, 15);
  EXPECT_NEAR(static_cast<double>(at(host, VehicleClock::Host, 5.0).offset_ns), 40e3 + 80e3, 10);
}

/// Returns every fault of what the devices send, on each device that it can hit.
std::vector<FaultLine> all_lines() {
  std::vector<FaultLine> out;
  for (const FaultEntry& entry : fault_registry())
    for (const FaultTarget target : entry.targets) {
      if (FaultyDisk::concerns(entry.type)) continue;
      out.push_back(FaultLine::usual(entry.type, 2, 2));
      out.back().target = target;
      if (target == FaultTarget::Pps && entry.unit && entry.unit == std::string("share"))
        out.back().strength = 1;  // there are only two edges
    }
  return out;
}
class EachFault : public testing::TestWithParam<FaultLine> {};
INSTANTIATE_TEST_SUITE_P(Registry, EachFault, testing::ValuesIn(all_lines()),
                         [](const testing::TestParamInfo<FaultLine>& line) {
                           return std::string(entry_of(line.param.type).name) + "_" + name(line.param.target);
                         });

TEST_P(EachFault, ChangesTheTimelineOnlyFromItsBeginningAndTheSameWayTwice) {
  const FaultLine line = GetParam();
  const Drive clean_drive = drive();
  const Timeline clean = *build_timeline(clean_drive, {});
  const auto spoilt = build_faulty_timeline(clean_drive, {}, {line});
  ASSERT_TRUE(spoilt.ok()) << spoilt.error().message;
  EXPECT_TRUE(same(spoilt->timeline, build_faulty_timeline(clean_drive, {}, {line})->timeline));
  EXPECT_TRUE(std::is_sorted(spoilt->timeline.events.begin(), spoilt->timeline.events.end(),
                             [](const auto& a, const auto& b) { return a.at_ns < b.at_ns; }));
  // Latencies of up to 60 ms lie between a time and its packet.
  const auto before = [&](const WireEvent& e) { return e.at_ns < line.begin_ns() - 100'000'000; };
  std::vector<WireEvent> a, b;
  std::copy_if(clean.events.begin(), clean.events.end(), std::back_inserter(a), before);
  std::copy_if(spoilt->timeline.events.begin(), spoilt->timeline.events.end(), std::back_inserter(b), before);
  EXPECT_TRUE(
      std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) { return same(x, y); }));
  if (line.type == FaultType::HourWrapLate) return;  // no UTC hour begins in this drive
  EXPECT_GT(spoilt->hits.at(0), 0u);
  EXPECT_FALSE(same(clean, spoilt->timeline));
}

TEST(FaultyTimeline, FaultsOfTheDiskAreNoneOfTheDevices) {
  const Drive d = drive();
  const Timeline clean = *build_timeline(d, {});
  for (const FaultEntry& entry : fault_registry())
    if (FaultyDisk::concerns(entry.type)) {
      EXPECT_TRUE(same(build_faulty_timeline(d, {}, {FaultLine::usual(entry.type, 2, 2)})->timeline, clean))
          << entry.name;
    }
}

TEST(FaultyTimeline, WithoutLinesIsTheTimeline) {
  const Drive d = drive();
  EXPECT_TRUE(same(build_faulty_timeline(d, {}, {})->timeline, *build_timeline(d, {})));
}

Timeline with(FaultLine line) { return build_faulty_timeline(drive(), {}, {line})->timeline; }
FaultLine line_of(FaultType type, double strength, FaultTarget target) {
  FaultLine line = FaultLine::usual(type, 2, 2);
  line.strength = strength;
  line.target = target;
  return line;
}

TEST(FaultyTimeline, LosesTheShareThatTheLineSays) {
  const Timeline clean = *build_timeline(drive(), {});
  const std::size_t all = count(clean, WireChannel::LaserData);
  EXPECT_EQ(count(with(line_of(FaultType::PacketLoss, 1, FaultTarget::Laser)), WireChannel::LaserData), all - 400);
  EXPECT_NEAR(static_cast<double>(
                  count(with(line_of(FaultType::PacketLoss, 0.25, FaultTarget::Laser)), WireChannel::LaserData)),
              static_cast<double>(all) - 100, 35);
  EXPECT_EQ(count(with(line_of(FaultType::BurstLoss, 30, FaultTarget::Laser)), WireChannel::LaserData), all - 60);
  EXPECT_EQ(count(with(line_of(FaultType::MarkLoss, 1, FaultTarget::Pos)), WireChannel::Pos, 1130), 38u);
  EXPECT_EQ(count(with(line_of(FaultType::MarkLoss, 1, FaultTarget::Pos)), WireChannel::Pos, 1067), 38u);
  EXPECT_EQ(count(with(line_of(FaultType::PosGap, 0, FaultTarget::Pos)), WireChannel::Pos, 507), 601u - 200u);
  EXPECT_EQ(count(with(line_of(FaultType::PosGap, 0, FaultTarget::Pos)), WireChannel::Pos, 101), 6u);
}

/// Returns the pulses of the rear left wheel, read at their place in the frame.
std::vector<int> pulses(const Timeline& t) {
  std::vector<int> out;
  for (const WireEvent& e : t.events)
    if (e.channel == WireChannel::Wheel && e.payload[0] == std::byte{0xA0})
      out.push_back(std::to_integer<int>(e.payload[8]) << 8 | std::to_integer<int>(e.payload[9]));
  return out;
}

TEST(FaultyTimeline, WheelsStandSpinAndGoOffTheBus) {
  const auto clean = pulses(*build_timeline(drive(), {}));
  ASSERT_EQ(clean.size(), 300u);
  EXPECT_EQ(clean.back(), 4 * 299);
  const auto stuck = pulses(with(FaultLine::usual(FaultType::WheelStuck, 2, 2)));
  EXPECT_EQ(stuck[99], 4 * 99);
  EXPECT_EQ(stuck[199], 4 * 99) << "standing";
  EXPECT_EQ(stuck.back(), 4 * 199) << "and on from there";
  const auto slip = pulses(with(line_of(FaultType::WheelSlip, 1.5, FaultTarget::Wheel)));
  EXPECT_EQ(slip.back(), 4 * 299 + 2 * 100);

  const Timeline off = with(FaultLine::usual(FaultType::CanBusOff, 2, 2));
  std::vector<const WireEvent*> frames;
  for (const WireEvent& e : off.events)
    if (e.channel == WireChannel::Wheel) frames.push_back(&e);
  EXPECT_EQ(frames.size(), 400u + 2u);
  const auto told =
      std::find_if(frames.begin(), frames.end(), [](const WireEvent* e) { return e->payload[3] == std::byte{0x20}; });
  ASSERT_NE(told, frames.end());
  EXPECT_EQ((*told)->at_ns, 2'000'000'000);
  EXPECT_EQ((*told)->payload[0], std::byte{0x40});
  EXPECT_EQ((*std::next(told))->at_ns, 4'000'000'000);
  EXPECT_EQ((*std::next(told))->payload[1], std::byte{0x01});
}

TEST(FaultyTimeline, PulsesAreCountedAsTheInputSeesThem) {
  for (const FaultType type : {FaultType::PpsLoss, FaultType::PpsSpurious, FaultType::PpsWidth}) {
    std::uint64_t expected = 0;
    for (const WireEvent& e : with(FaultLine::usual(type, 2, 2)).events) {
      if (e.channel == WireChannel::Pps) {
        EXPECT_EQ(e.sequence, ++expected);
      }
    }
    EXPECT_EQ(expected, type == FaultType::PpsLoss ? 4u : type == FaultType::PpsWidth ? 8u : 12u);
  }
}

TEST(FaultyTimeline, ACameraThatReturnsCountsAnew) {
  const Timeline t = with(line_of(FaultType::CameraDisconnect, 5, FaultTarget::Camera));
  std::vector<WireEvent> images;
  std::copy_if(t.events.begin(), t.events.end(), std::back_inserter(images),
               [](const WireEvent& e) { return e.channel == WireChannel::Camera; });
  ASSERT_EQ(images.size(), 38u);
  const auto back =
      std::find_if(images.begin(), images.end(), [](const WireEvent& e) { return e.at_ns >= 4'000'000'000; });
  EXPECT_EQ(back->sequence, 0u);
  EXPECT_EQ(back->camera_counter_ns, 5'000'000'000);
  EXPECT_EQ((back + 1)->sequence, 1u);
  EXPECT_EQ((back + 1)->number, back->number + 1);
}

TEST(FaultyTimeline, ALineThatTheRegistryRefusesIsNamed) {
  const auto refused = build_faulty_timeline(drive(), {}, {line_of(FaultType::PpsShift, 0, FaultTarget::Camera)});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("faults[0]: target: pps_shift"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace hueline::sim
