#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sync/clock_course.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;
using testing::HasSubstr;

constexpr SensorId kOther = 9;

/// The usual rig: pulses, labels of the POS 30 to 100 ms late, solutions at 20 Hz.
void usual(Drive& drive, double jitter_us = 3, Drive::When lost = Drive::never) {
  drive.pps(gaussian(jitter_us), lost);
  drive.labels(kPos, late(30, 20));
  drive.ins(20, late(4, 2));
}
Drive::Shift constant(seconds s) {
  return [=](GpsTime) { return s; };
}

TEST(HostClockModel, GivenCleanPulsesWhenLabelledThenLocksWithinTenSecondsToMicroseconds) {
  Drive drive(some_begin(), seconds(300));
  drive.pps(gaussian(2));
  drive.labels(kPos, late(30, 20));
  drive.ins(50, late(4, 2));
  Course run(drive, clock_config());
  EXPECT_EQ(run.at(drive.begin + seconds(10)), SyncState::Locked);
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  run.expect_never_wrong_by(us(60));
  EXPECT_LT(std::abs(run.samples.back().error_us()), 5);
  EXPECT_LT(run.samples.back().stamp->sigma, us(3));
  EXPECT_TRUE(run.faults.empty()) << run.faults.front().detail;
  EXPECT_EQ(run.model.counts().refused, 0u);
}

TEST(HostClockModel, GivenADriveThatIsTooShortForItsPulsesThenSaysWhetherTheyAreFewOrScatter) {
  const auto ends = [](double jitter_us, int pulses) {
    Drive drive(some_begin(), seconds(pulses));
    usual(drive, jitter_us);
    return Course(drive, clock_config()).model;
  };
  const HostClockModel few = ends(3, 3), far_apart = ends(5000, 20), scattered = ends(500, 20), enough = ends(3, 12);
  EXPECT_FALSE(few.can_stamp());
  EXPECT_STREQ(few.why_not(), "too few pulses came to learn the clock");
  EXPECT_FALSE(far_apart.can_stamp());
  EXPECT_STREQ(far_apart.why_not(), "the pulses that came do not lie whole seconds apart");
  EXPECT_FALSE(scattered.can_stamp());
  EXPECT_STREQ(scattered.why_not(), "the pulses scatter too much to learn the clock in so short a time");
  EXPECT_TRUE(enough.can_stamp());
  EXPECT_STREQ(enough.why_not(), "");
}

TEST(HostClockModel, GivenPulsesThatScatterFromTheBeginningThenLocksAsSoonAsTheyAllow) {
  // An edge that scatters by s tells the time to s, and n of them to about 2 s / sqrt(n).
  for (const auto& [jitter_us, locked_s] : {std::pair{100.0, 10}, std::pair{200.0, 30}}) {
    Drive drive(some_begin(), seconds(60));
    usual(drive, jitter_us);
    Course run(drive, clock_config());
    // Locked, or Holdover while sigma is a little above what Locked asks for: both give times.
    EXPECT_GE(run.at(drive.begin + seconds(locked_s)), SyncState::Locked) << jitter_us;
    EXPECT_GE(run.model.state(), SyncState::Locked) << jitter_us;
    EXPECT_LE(run.model.counts().refused, 2u) << jitter_us;
    for (const auto& sample : run.samples)
      if (sample.state == SyncState::Locked) {
        EXPECT_LT(std::abs(sample.normalised()), 4) << jitter_us;
      }
  }
}

TEST(HostClockModel, GivenPulsesLostForAMinuteThenHoldsOverWithTrueSigmaAndRelocksAfterThree) {
  Drive drive(some_begin(), seconds(1500), {12, 0.05, 2, 0, 0, 900});
  const GpsTime gone = drive.begin + seconds(1200), back = gone + seconds(60);
  usual(drive, 5, [&](GpsTime t) { return t > gone && t < back; });
  Course run(drive, clock_config());
  nanoseconds sigma{0};
  int held = 0, good = 0;
  for (const auto& s : run.samples) {
    if (s.truth < gone + seconds(5) || s.truth > back - seconds(1)) continue;
    ASSERT_EQ(s.state, SyncState::Holdover);
    EXPECT_GE(s.stamp->sigma, sigma) << "sigma must not shrink without an edge";
    sigma = s.stamp->sigma;
    ++held;
    good += std::abs(s.normalised()) < 3 ? 1 : 0;
  }
  EXPECT_GT(held, 500);
  EXPECT_GT(good, held * 95 / 100);
  EXPECT_GT(sigma, us(1));
  EXPECT_LT(sigma, us(20));
  EXPECT_EQ(run.at(back + ms(1500)), SyncState::Holdover) << "one edge is not enough";
  EXPECT_EQ(run.at(back + seconds(5)), SyncState::Locked);
  EXPECT_EQ(run.model.counts().holdovers, 1u);
  EXPECT_EQ(run.model.counts().missing, 60u);
  EXPECT_EQ(run.count(FaultKind::Silent), 1u);
  run.expect_never_wrong_by(us(60));
}

TEST(HostClockModel, GivenPulsesLostForEverThenGivesUpAndFallsBackToArrivals) {
  Drive drive(some_begin(), seconds(1800), {12, 0.5, 20, 0, 0, 900});
  const GpsTime gone = drive.begin + seconds(200);
  usual(drive, 5, [&](GpsTime t) { return t > gone; });
  HostClockModel::Config config = clock_config();
  config.holdover_limit = us(300);
  Course run(drive, config);
  EXPECT_EQ(run.at(gone + seconds(60)), SyncState::Holdover);
  EXPECT_EQ(run.model.state(), SyncState::Acquiring);
  EXPECT_TRUE(run.model.is_from_arrivals());
  EXPECT_TRUE(run.model.can_stamp());
  EXPECT_THAT(run.details(FaultKind::NoTime), HasSubstr("arrival"));
  EXPECT_LT(std::abs(run.samples.back().normalised()), 3);
  run.expect_never_wrong_by(ms(20));
}

TEST(HostClockModel, GivenSpuriousEdgesThenTheyAreRefusedAndCounted) {
  Drive drive(some_begin(), seconds(300));
  usual(drive);
  std::uint64_t spurious = 0;
  for (GpsTime t = drive.begin + seconds(20); t < drive.end - seconds(2); t += seconds(3)) {
    drive.edge_at(drive.clock.host(t + us(drive.random.uniform(1e3, 749e3))), 0);  // begin is .25 s: never on a second
    ++spurious;
  }
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_EQ(run.model.counts().refused, spurious);
  EXPECT_EQ(run.count(FaultKind::Spurious), spurious);
  EXPECT_EQ(run.count(FaultKind::ClockStep), 0u);
  run.expect_never_wrong_by(us(60));
}

TEST(HostClockModel, GivenEveryEdgeTwiceThenTheSecondIsRefused) {
  Drive drive(some_begin(), seconds(120));
  usual(drive, 1);
  for (GpsTime t = Drive::ceil_second(drive.begin); t < drive.end; t += seconds(1))
    drive.edge_at(drive.clock.host(t) + us(120), 0);
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_GT(run.model.counts().refused + run.model.counts().doubled, 105u);
  EXPECT_LT(std::abs(run.samples.back().error_us()), 10);
}

TEST(HostClockModel, GivenHalfSecondEdgesBetweenWhenLockedThenTheyChangeNothing) {
  Drive drive(some_begin(), seconds(200));
  usual(drive);
  for (GpsTime t = Drive::ceil_second(drive.begin + seconds(30)); t < drive.end; t += seconds(1))
    drive.edge_at(drive.clock.host(t + ms(500)), 0);
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_GE(run.model.counts().refused, 168u);
  run.expect_never_wrong_by(us(60));
}

TEST(HostClockModel, GivenTwoPulsesASecondFromTheStartThenItDoesNotGuess) {
  Drive drive(some_begin(), seconds(60));
  for (GpsTime t = Drive::ceil_second(drive.begin); t < drive.end; t += ms(500)) drive.edge_at(drive.clock.host(t), 0);
  drive.labels(kPos, late(30, 20));
  drive.ins(20, late(4, 2));
  HostClockModel::Config config = clock_config();
  config.pps_patience = seconds(600);
  Course run(drive, config);
  EXPECT_EQ(run.model.state(), SyncState::Unlocked);
  EXPECT_THAT(run.details(FaultKind::Spurious), HasSubstr("more than one phase"));
}

TEST(HostClockModel, GivenAJitterBurstThenSigmaGrowsWithItAndTheLockIsKept) {
  Drive drive(some_begin(), seconds(1200));
  const GpsTime burst = drive.begin + seconds(600);
  drive.pps([&](Random& r, GpsTime t) { return us(r.gauss(t > burst && t < burst + seconds(120) ? 150 : 3)); });
  drive.labels(kPos, late(30, 20));
  drive.ins(20, late(4, 2));
  Course run(drive, clock_config());
  int n = 0, inside = 0;
  for (const auto& s : run.samples) {
    if (s.truth < burst - seconds(100) || !s.can_stamp) continue;
    ++n;
    inside += std::abs(s.normalised()) < 3 ? 1 : 0;
  }
  EXPECT_GT(inside, n * 97 / 100);
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  run.expect_never_wrong_by(us(200));
}

TEST(HostClockModel, GivenPulsesThatMoveToAnotherPhaseThenItStartsAnewAndSaysSo) {
  Drive drive(some_begin(), seconds(200));
  // The receiver's pulses are first 0.3 s off the second (no fix yet), then they step to the second.
  const GpsTime step = drive.begin + seconds(60);
  drive.pps([&](Random& r, GpsTime t) { return us(r.gauss(3)) + (t < step ? ms(300) : ms(0)); });
  drive.labels(kPos, late(330, 20), constant(seconds(0)), [&](GpsTime t) { return t < step; });
  drive.ins(20, late(4, 2));
  HostClockModel::Config config = clock_config();
  config.label.decisive_latency = ms(150);  // 0.3 s off, so arrivals do not settle it
  Course run(drive, config);
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_EQ(run.model.counts().restarts, 1u);
  EXPECT_EQ(run.count(FaultKind::ClockStep), 1u);
  EXPECT_LT(std::abs(run.samples.back().error_us()), 10);
}

TEST(HostClockModel, GivenALabelThatWasWrongFromTheStartThenItIsHeldBackAndChanged) {
  // A trusted receiver is 18 s off for its first minute, then right. There is no other source.
  Drive drive(some_begin(), seconds(300));
  const GpsTime mended = drive.begin + seconds(60);
  const auto shift = [=](GpsTime t) { return t < mended ? seconds(-18) : seconds(0); };
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20), shift);
  drive.ins(20, late(4, 2), shift);
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_EQ(run.model.counts().relabels, 1u);
  EXPECT_THAT(run.details(FaultKind::ClockStep), HasSubstr("18 s"));
  EXPECT_LT(std::abs(run.samples.back().error_us()), 10);
  EXPECT_EQ(run.at(mended + seconds(5)), SyncState::Acquiring) << "doubted while it is contradicted";
}

TEST(HostClockModel, GivenNoPulsesAtAllThenArrivalsGiveMillisecondsHonestly) {
  Drive drive(some_begin(), seconds(600), {40, 0.05, 2, 0, 0, 900});
  drive.labels(kPos, late(30, 20));
  drive.ins(50, late(4, 3));
  HostClockModel::Config config = clock_config();
  config.pps = kSystemSensor;
  Course run(drive, config);
  EXPECT_EQ(run.model.state(), SyncState::Acquiring);
  EXPECT_TRUE(run.model.can_stamp());
  for (const auto& s : run.samples)
    if (s.can_stamp) {
      EXPECT_LT(std::abs(s.normalised()), 3);
      EXPECT_GE(s.stamp->sigma, ms(3));
      EXPECT_LT(s.stamp->sigma, ms(8));
    }
}

TEST(HostClockModel, GivenNoPulsesAndSourcesAtOddsThenNothingIsStamped) {
  Drive drive(some_begin(), seconds(120));
  drive.ins(50, late(4, 3));
  drive.ins(10, late(4, 3), constant(seconds(18)), kOther);
  HostClockModel::Config config = clock_config();
  config.pps = kSystemSensor;
  config.label.trusted = kSystemSensor;
  Course run(drive, config);
  EXPECT_FALSE(run.model.can_stamp());
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("UTC"));
}

TEST(HostClockModel, GivenTheSameInputThenTheSameOutput) {
  const auto once = [] {
    Drive drive(some_begin(), seconds(200), {12, 0.05, 2, 0, 0, 900}, 5);
    usual(drive, 20, [](GpsTime t) { return count_ns(t) / 1'000'000'000 % 7 == 3; });
    return Course(drive, clock_config());
  };
  const Course a = once(), b = once();
  ASSERT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    ASSERT_EQ(a.samples[i].stamp.has_value(), b.samples[i].stamp.has_value());
    if (!a.samples[i].stamp) continue;
    ASSERT_EQ(a.samples[i].stamp->time, b.samples[i].stamp->time);
    ASSERT_EQ(a.samples[i].stamp->sigma, b.samples[i].stamp->sigma);
  }
}

TEST(HostClockModel, GivenSettingsOutOfRangeThenTheSentenceNamesTheKey) {
  HostClockModel::Config config = clock_config();
  EXPECT_EQ(config.validate(), "");
  config.acquire_edges = 0;
  EXPECT_THAT(config.validate(), HasSubstr("acquire_edges"));
  config = clock_config();
  config.filter.gate_sigmas = 1;
  EXPECT_THAT(config.validate(), HasSubstr("filter: gate_sigmas"));
  config = clock_config();
  config.filter.jitter_us = std::nan("");
  EXPECT_THAT(config.validate(), HasSubstr("jitter_us"));
}

}  // namespace
}  // namespace hueline::sync
