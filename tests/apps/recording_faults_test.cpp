// Tests the faults of the computer itself: a disk that is slow, full or made read-only, a program that is killed, a
// power cut. The recording holds what it promises and nothing else, what is lost is reported, and its replay equals
// that of the packets themselves.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/apps/faulty_drive.hpp"

namespace hueline::test {
namespace {

using sim::FaultLine;
using sim::FaultType;
using Death = sim::FaultyDisk::Death;

FaultLine line_of(FaultType type, double at_s, double for_s = 1, double strength = 0) {
  FaultLine line = FaultLine::usual(type, at_s, for_s);
  line.strength = strength;
  return line;
}

void expect_honest(const RecordedOutcome& out) {
  const score::RecordingFacts& facts = out.facts;
  EXPECT_GT(facts.promised, 1000u);
  EXPECT_EQ(facts.promised_missing, 0u) << "of " << facts.promised;
  EXPECT_EQ(facts.changed, 0u);
  EXPECT_EQ(facts.untold, 0u);
  EXPECT_EQ(facts.untold_bytes, 0u);
  EXPECT_GE(facts.recovered, facts.promised);
  EXPECT_TRUE(facts.is_same_cloud);
}

TEST(RecordingFaults, AHealthyComputerRecordsAll) {
  const RecordedOutcome out = FaultyDrive::shared().record({});
  expect_honest(out);
  EXPECT_TRUE(out.capture.recording.ok());
  EXPECT_EQ(out.facts.recovered, out.facts.came);
  EXPECT_EQ(out.facts.promised, out.facts.came);
  EXPECT_EQ(out.facts.end_lost_s, 0);
}

TEST(RecordingFaults, ADiskThatHangsLongerThanTheQueueLastsLosesWhatIsTold) {
  const RecordedOutcome out = FaultyDrive::shared().record({line_of(FaultType::DiskSlow, 12, 4.2, 0)});
  expect_honest(out);
  EXPECT_TRUE(out.capture.recording.ok());
  EXPECT_GT(out.facts.refused, 100u);
  EXPECT_EQ(out.facts.told, out.facts.refused);
  EXPECT_EQ(out.facts.recovered, out.facts.came - out.facts.refused);
}

TEST(RecordingFaults, ADiskThatIsSlowToTheEndIsToldInTheRecordingToo) {
  const RecordedOutcome out = FaultyDrive::shared().record({line_of(FaultType::DiskSlow, 10.2, 60, 0.2)});
  expect_honest(out);
  EXPECT_GT(out.facts.refused, 100u);
  EXPECT_EQ(out.facts.told, out.facts.refused) << "also what was refused last";
}

TEST(RecordingFaults, AShortHangCostsNothing) {
  const RecordedOutcome out = FaultyDrive::shared().record({line_of(FaultType::DiskSlow, 12, 1, 0)});
  expect_honest(out);
  EXPECT_EQ(out.facts.refused, 0u);
  EXPECT_EQ(out.facts.recovered, out.facts.came);
}

TEST(RecordingFaults, AFullDiskHoldsExactlyWhatTheProgramSays) {
  for (const double megabytes : {1.0, 3.21}) {
    const RecordedOutcome out = FaultyDrive::shared().record({line_of(FaultType::DiskFull, 12, 100, megabytes)});
    expect_honest(out);
    EXPECT_FALSE(out.capture.recording.ok());
    EXPECT_NE(out.capture.recording.error().message.find("disk is full"), std::string::npos)
        << out.capture.recording.error().message;
    EXPECT_EQ(out.facts.recovered, out.facts.promised) << "not one more, not one less";
    EXPECT_LT(out.facts.recovered, out.facts.came);
  }
}

TEST(RecordingFaults, ADiskMadeReadOnlyHoldsAtLeastWhatTheProgramSays) {
  const RecordedOutcome out = FaultyDrive::shared().record({line_of(FaultType::DiskReadOnly, 15.9)});
  expect_honest(out);
  EXPECT_FALSE(out.capture.recording.ok());
  EXPECT_LE(out.facts.end_lost_s, 2.6) << "2 s since the last sync, and until a write is refused";
}

/// The program may end in this way at any of these times.
void expect_end_lost(FaultType type, Death death, double most_s, std::initializer_list<double> times_s) {
  for (const double at_s : times_s) {
    const RecordedOutcome out = FaultyDrive::shared().record({line_of(type, at_s)});
    expect_honest(out);
    EXPECT_EQ(out.capture.death, death);
    EXPECT_LE(out.facts.end_lost_s, most_s) << at_s;
  }
}
TEST(RecordingFaults, AKilledProgramLosesHalfASecondAtMost) {
  expect_end_lost(FaultType::ProcessKill, Death::ProcessKill, 0.51, {11.003, 14.77, 17.999});
}
TEST(RecordingFaults, APowerCutLosesTwoSecondsAtMost) {
  expect_end_lost(FaultType::PowerCut, Death::PowerCut, 2.01, {12.1, 13.95, 17.2});
}

TEST(RecordingFaults, APowerCutWhileTheDiskHangsLosesWhatWaitedToo) {
  const RecordedOutcome out =
      FaultyDrive::shared().record({line_of(FaultType::DiskSlow, 13, 60, 0), line_of(FaultType::PowerCut, 16)});
  expect_honest(out);
  EXPECT_GT(out.facts.end_lost_s, 2.01);
  EXPECT_LE(out.facts.end_lost_s, 5.01);
}

TEST(RecordingFaults, ADiskThatLiesIsNoticed) {
  const auto lie = [](const std::filesystem::path& file) {
    std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  };
  const RecordedOutcome cut = FaultyDrive::shared().record({line_of(FaultType::PowerCut, 17)}, lie);
  EXPECT_GT(cut.facts.promised_missing, 100u);
  EXPECT_EQ(cut.facts.untold, 0u) << "who reads it is told that it was cut";
  const RecordedOutcome whole = FaultyDrive::shared().record({}, lie);
  EXPECT_GT(whole.facts.promised_missing, 100u);
  EXPECT_GT(whole.facts.untold, 100u) << "the program said that all is recorded";
  EXPECT_GT(whole.facts.untold_bytes, 100'000u);
}

/// Every fault of the registry that happens to the computer is tested above, and does what its entry says.
TEST(RecordingFaults, AreWhatTheRegistrySays) {
  for (const sim::FaultEntry& entry : sim::fault_registry()) {
    if (!sim::FaultyDisk::concerns(entry.type)) continue;
    ASSERT_EQ(entry.targets.size(), 1u);
    EXPECT_EQ(*entry.targets.begin(), sim::FaultTarget::Host);
    if (entry.type == FaultType::DiskSlow) {
      EXPECT_EQ(std::vector<FaultKind>(entry.told), std::vector{FaultKind::Overflow});
    } else if (entry.outcome == sim::FaultOutcome::Told) {
      EXPECT_EQ(std::vector<FaultKind>(entry.told), std::vector{FaultKind::DiskFull}) << entry.name;
    } else {
      EXPECT_EQ(entry.outcome, sim::FaultOutcome::Cut) << entry.name;
    }
  }
}

}  // namespace
}  // namespace hueline::test
