// Runs every fault of the registry through decoders, sync and fusion. No output may be silently wrong, the fault must
// be reported, what it does not concern must stay, and every byte must be explained.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "drivers/pps/pps_packet.hpp"
#include "runtime/ingest.hpp"
#include "tests/apps/faulty_drive.hpp"

namespace hueline::test {
namespace {

using sim::FaultLine;
using sim::FaultOutcome;
using sim::FaultTarget;
using sim::FaultType;

constexpr double kBegin = FaultyDrive::kFaultBegin, kEnd = FaultyDrive::kFaultEnd;

/// Returns every fault of the data that the devices send, on each of them. Faults of the computer's disk are tested in
/// recording_faults_test.cpp.
std::vector<FaultLine> all_lines() {
  std::vector<FaultLine> out;
  for (const sim::FaultEntry& entry : sim::fault_registry())
    for (const FaultTarget target : entry.targets) {
      if (sim::FaultyDisk::concerns(entry.type)) continue;
      out.push_back(FaultLine::usual(entry.type, kBegin, kEnd - kBegin));
      out.back().target = target;
      const bool is_rare = target == FaultTarget::Pps || target == FaultTarget::LaserStatus;
      if (is_rare && entry.unit && entry.unit == std::string("share"))
        out.back().strength = 1;  // strength for two edges, or twenty datagrams
    }
  const auto add = [&](FaultType type, double strength, FaultTarget target) {
    out.push_back(FaultLine::usual(type, kBegin, kEnd - kBegin));
    out.back().strength = strength;
    out.back().target = target;
  };
  // A clock that stepped needs five pulses to be found again, so the step comes early enough for the drive to show it.
  for (FaultLine& line : out)
    if (line.type == FaultType::HostClockStep) line.at_s = FaultyDrive::kSensorsBegin + 1.6;
  // These are the other directions of faults that have two, and further strengths that occur in the field.
  add(FaultType::InsLabel, -1, FaultTarget::Pos);
  add(FaultType::UtcOffset, -18, FaultTarget::Pos);
  add(FaultType::UtcOffset, -18, FaultTarget::LaserStatus);
  add(FaultType::PpsLabel, -1, FaultTarget::Pos);
  add(FaultType::PpsLabel, -1, FaultTarget::LaserStatus);
  add(FaultType::LaserClockStep, 0.25, FaultTarget::Laser);
  add(FaultType::LaserClockStep, 1, FaultTarget::Laser);
  add(FaultType::CameraClockStep, -0.0333, FaultTarget::Camera);
  add(FaultType::CameraClockStep, 30, FaultTarget::Camera);
  add(FaultType::MarkShift, -300, FaultTarget::Pos);
  add(FaultType::NmeaLate, 0.9, FaultTarget::LaserStatus);
  add(FaultType::HostClockStep, 2.5, FaultTarget::Host);
  out.back().at_s = FaultyDrive::kSensorsBegin + 1.6;
  add(FaultType::LateDelivery, 300, FaultTarget::Pos);
  add(FaultType::AttitudeJump, 0.5, FaultTarget::Pos);
  add(FaultType::PpsShift, 100, FaultTarget::Pps);
  return out;
}

std::string words(const FaultyOutcome& outcome) {
  std::string out = "told:\n";
  for (const std::string& fault : outcome.faults) out += "  " + fault + "\n";
  for (const std::string& stamp : outcome.wrong_stamps) out += "  wrong: " + stamp + "\n";
  return out;
}

double share(std::uint32_t part, std::uint32_t whole) { return whole ? static_cast<double>(part) / whole : 0.0; }

/// Returns the middle of the last exposure that has a time in the clean drive and none in this one, s; 0: there is
/// none.
double last_lost_exposure(const FaultyOutcome& out, const FaultyOutcome& clean) {
  double last = 0;
  for (const auto& [number, stamp] : clean.exposures)
    if (!out.exposures.contains(number)) last = FaultyDrive::kSensorsBegin + number * FaultyDrive::kExposureInterval;
  return last;
}

class Faults : public testing::TestWithParam<FaultLine> {};
INSTANTIATE_TEST_SUITE_P(Registry, Faults, testing::ValuesIn(all_lines()),
                         [](const testing::TestParamInfo<FaultLine>& line) {
                           return fmt::format("{}_{}_{}", sim::entry_of(line.param.type).name,
                                              sim::name(line.param.target), line.index);
                         });

TEST_P(Faults, AreSurvivedAndTold) {
  const FaultLine line = GetParam();
  const sim::FaultEntry& entry = sim::entry_of(line.type);
  const FaultyOutcome& clean = FaultyDrive::shared().clean();
  const FaultyOutcome out = FaultyDrive::shared().run({line});
  const auto before = out.sum(line.at_s - 1.3, line.at_s - 0.2),
             clean_before = clean.sum(line.at_s - 1.3, line.at_s - 0.2);
  const auto during = out.sum(kBegin, kEnd), clean_during = clean.sum(kBegin, kEnd);
  const auto after = out.sum(kEnd + 1.5, FaultyDrive::kSensorsEnd - 0.2),
             clean_after = clean.sum(kEnd + 1.5, FaultyDrive::kSensorsEnd - 0.2);
  // A point may take its colour from exposures up to a second and a half before it.
  const double whole = std::max(kEnd, last_lost_exposure(out, clean)) + 1.5;
  const auto seen_after = out.sum(whole, FaultyDrive::kSensorsEnd - 0.2),
             clean_seen_after = clean.sum(whole, FaultyDrive::kSensorsEnd - 0.2);
  const auto all = out.sum(0, 1e9);

  // No output is silently wrong.
  EXPECT_EQ(out.strange_batches, 0u);
  EXPECT_EQ(out.wrong_laser, 0u) << words(out);
  EXPECT_EQ(out.wrong_exposures, 0u) << words(out);
  EXPECT_LE(all.misplaced, all.judged / 1000) << "largest " << out.largest_place_error_m << " m\n" << words(out);
  EXPECT_LE(all.wrong_pixel, all.judged / 1000) << words(out);

  // The fault is reported, or it does not matter. Position datagrams repeat themselves, so one more or less changes
  // nothing. A second that is named a little too late is no contradiction.
  const bool is_repeated = line.target == FaultTarget::LaserStatus && line.type <= FaultType::LateDelivery &&
                           line.type != FaultType::Truncation;
  const bool is_late_name = line.target == FaultTarget::Pos && line.type == FaultType::PpsLabel && line.strength < 0;
  const bool is_late_nmea = line.type == FaultType::NmeaLate && line.strength < 1;
  if (entry.outcome == FaultOutcome::Told && !is_repeated && !is_late_name && !is_late_nmea) {
    std::uint64_t told = 0;
    for (const FaultKind kind : entry.told) {
      const auto found = out.told.find(kind), usual = clean.told.find(kind);
      if (found != out.told.end())
        told += found->second - (usual != clean.told.end() ? std::min(usual->second, found->second) : 0);
    }
    EXPECT_GT(told, 0u) << words(out);
  } else {
    EXPECT_EQ(out.laser.size(), clean.laser.size()) << words(out);
    EXPECT_EQ(out.exposures.size(), clean.exposures.size()) << words(out);
    EXPECT_GE(share(during.coloured, during.points), share(clean_during.coloured, clean_during.points) - 0.01)
        << words(out);
    EXPECT_GE(during.points, clean_during.points * 99 / 100) << words(out);
  }

  // The data before the fault is unchanged, and the data behind it is as good again.
  EXPECT_GE(before.points, clean_before.points * 98 / 100);
  EXPECT_GE(share(before.coloured, before.points), share(clean_before.coloured, clean_before.points) - 0.02)
      << words(out);
  EXPECT_GE(after.points, clean_after.points * 95 / 100) << words(out);
  EXPECT_GE(clean_seen_after.points, 10'000u);
  EXPECT_GE(share(seen_after.coloured, seen_after.points),
            share(clean_seen_after.coloured, clean_seen_after.points) - 0.05)
      << words(out);

  for (const auto& [sensor, counts] : out.bytes) EXPECT_EQ(counts.first, counts.second) << sensor;
}

FaultyOutcome outcome_of(FaultType type, FaultTarget target, std::optional<double> strength = {}) {
  FaultLine line = FaultLine::usual(type, kBegin, kEnd - kBegin);
  line.target = target;
  line.strength = strength.value_or(line.strength);
  return FaultyDrive::shared().run({line});
}

/// What is lost on the way is reported as lost, once, with the right number of units.
TEST(Faults, LossesAreToldWithTheirNumber) {
  for (const auto& [type, target] :
       {std::pair(FaultType::PacketLoss, FaultTarget::Laser), std::pair(FaultType::BurstLoss, FaultTarget::Laser),
        std::pair(FaultType::Outage, FaultTarget::Laser), std::pair(FaultType::PacketLoss, FaultTarget::Pos),
        std::pair(FaultType::BurstLoss, FaultTarget::Pos), std::pair(FaultType::Outage, FaultTarget::Pos),
        std::pair(FaultType::ImageLoss, FaultTarget::Camera), std::pair(FaultType::PacketLoss, FaultTarget::Wheel),
        std::pair(FaultType::Outage, FaultTarget::Wheel), std::pair(FaultType::Outage, FaultTarget::Pps)}) {
    FaultyOutcome out = outcome_of(type, target);
    EXPECT_GT(out.missing, 0u) << sim::entry_of(type).name << " " << sim::name(target);
    EXPECT_EQ(out.told[FaultKind::Lost], out.missing)
        << sim::entry_of(type).name << " " << sim::name(target) << ", " << words(out);
  }
  FaultyOutcome bus = outcome_of(FaultType::CanBusOff, FaultTarget::Wheel);
  EXPECT_EQ(bus.told[FaultKind::Lost] + 1, bus.hits.at(0)) << "frames, and the bus itself";
}

/// Data that comes late, damaged, or under another time is not lost, and neither is data that was never sent.
TEST(Faults, NothingElseIsToldLost) {
  using enum FaultType;
  for (const auto& [type, strength] : std::vector<std::pair<FaultType, std::optional<double>>>{{Stall, {}},
                                                                                               {LateDelivery, {}},
                                                                                               {Fragments, {}},
                                                                                               {Corruption, {}},
                                                                                               {Truncation, {}},
                                                                                               {LineNoise, {}},
                                                                                               {PosGap, {}},
                                                                                               {InsLabel, {}},
                                                                                               {InsLabel, -1},
                                                                                               {PpsLabel, {}},
                                                                                               {PpsLabel, -1},
                                                                                               {UtcOffset, {}},
                                                                                               {UtcOffset, -18},
                                                                                               {WeekRollover, {}},
                                                                                               {ReceiverTimeLost, {}},
                                                                                               {LabelLate, {}}}) {
    FaultyOutcome out = outcome_of(type, FaultTarget::Pos, strength);
    EXPECT_GT(out.hits.at(0), 0u) << sim::entry_of(type).name;
    EXPECT_EQ(out.told_lost[FaultyDrive::shared().pos()], 0u) << sim::entry_of(type).name << ", " << words(out);
  }
  for (const FaultType type : {Reorder, Duplicates, Truncation, ForeignPackets}) {
    FaultyOutcome out = outcome_of(type, FaultTarget::Laser);
    EXPECT_GT(out.hits.at(0), 0u) << sim::entry_of(type).name;
    EXPECT_EQ(out.told[FaultKind::Lost], 0u) << sim::entry_of(type).name << ", " << words(out);
  }
}

/// Runs a drive with a PPS source that sends, besides its edges, five edges a second whose stamps are off by these
/// times. They enter as live packets do.
void expect_unharmed_by_edges_off(std::vector<nanoseconds> offs) {
  FaultyDrive& drive = FaultyDrive::shared();
  const FaultyOutcome& clean = drive.clean();
  runtime::PacketQueue record({100'000}), pipeline({100'000});
  runtime::Ingest ingest(std::vector<runtime::Ingest::Sensor>(drive.sensors()), record, pipeline, {100'000});
  std::map<std::uint64_t, std::uint64_t> sequences;  // number in the drive, by the sequence of Ingest
  HostTime now{}, lied{};
  std::uint64_t edge = 0, lies = 0;
  const auto submit = [&](Packet packet, const auto& process) {
    const std::uint64_t sequence = packet.sequence;
    now = std::max(now, packet.received);
    ingest.submit(std::move(packet), now);
    sequences[ingest.next_sequence() - 1] = sequence;
    while (record.size() > 0) record.pop();
    while (pipeline.size() > 0) {
      Packet entered = **pipeline.pop();
      const auto known = sequences.find(entered.sequence);
      entered.sequence = known != sequences.end() ? known->second : 0;
      process(entered);
    }
  };
  const FaultyOutcome out = drive.run({}, [&](const Packet& packet, const auto& process) {
    Packet own = packet;
    if (packet.sensor == drive.pps())
      own.bytes = Buffer::copy_of(drivers::encode_pps({drivers::PpsEdgeKind::Assert, ++edge, packet.received}));
    submit(own, process);
    if (now - lied < std::chrono::milliseconds(200)) return;
    lied = now;
    for (const nanoseconds off : offs) {
      const HostTime stamp = now + off;
      Packet lie{drive.pps(), PacketKind::Wire,
                 false,       0,
                 now,         Buffer::copy_of(drivers::encode_pps({drivers::PpsEdgeKind::Assert, ++edge, stamp}))};
      const HostTime arrived = now;
      lie.received = stamp;
      ingest.submit(std::move(lie), arrived);
      ++lies;
    }
  });
  EXPECT_GE(out.sum(0, 1e9).points, clean.sum(0, 1e9).points * 99 / 100) << words(out);
  EXPECT_GE(out.sum(0, 1e9).coloured, clean.sum(0, 1e9).coloured * 99 / 100) << words(out);
  EXPECT_EQ(out.wrong_laser + out.wrong_exposures, 0u) << words(out);
  EXPECT_GT(lies, 50u);
  const auto told = [&](FaultKind kind) { return out.told.contains(kind) ? out.told.at(kind) : 0; };
  EXPECT_GE(told(FaultKind::Spurious), lies - offs.size()) << "but for the last ones, which nothing takes in behind";
  EXPECT_GT(told(FaultKind::ClockStep), lies / 2);
}
TEST(Faults, EdgesStampedInTheFutureDoNotRuinTheDrive) {
  expect_unharmed_by_edges_off({std::chrono::seconds(1000), std::chrono::milliseconds(20)});
}
TEST(Faults, EdgesStampedOutOfAllTimeDoNotRuinTheDrive) {
  expect_unharmed_by_edges_off(
      {std::chrono::seconds(-900), std::chrono::hours(2'000'000), std::chrono::hours(-2'000'000)});
}

TEST(Faults, TheDriveWithoutThemIsWhole) {
  const FaultyOutcome& clean = FaultyDrive::shared().clean();
  const auto all = clean.sum(0, 1e9), middle = clean.sum(kBegin - 1.5, kEnd + 1.5);
  EXPECT_TRUE(clean.faults.empty()) << words(clean);
  EXPECT_EQ(clean.wrong_laser + clean.wrong_exposures + clean.unmatched_exposures, 0u) << words(clean);
  EXPECT_EQ(clean.exposures.size(), clean.images);
  // Two messages, 50 times a second, to a second after the scanners and the cameras.
  EXPECT_EQ(clean.wheels, 2 * ((static_cast<std::uint64_t>(FaultyDrive::kSensorsEnd) + 1) * 50 + 1));
  EXPECT_LT(clean.largest_wheel_error_us, 100);
  EXPECT_GT(share(middle.coloured, middle.points), 0.9);
  EXPECT_GT(share(middle.judged, middle.coloured), 0.9);
  EXPECT_GT(middle.points, 10'000u);
  EXPECT_EQ(all.misplaced + all.wrong_pixel, 0u) << clean.largest_place_error_m;
}

}  // namespace
}  // namespace hueline::test
