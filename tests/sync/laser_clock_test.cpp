#include "sync/laser_clock.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sync/simulated_rig.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;
using testing::HasSubstr;

/// A locked host and one scanner. Batches before `from` are not judged, because the host was not locked yet.
struct LaserCourse {
  std::vector<StampedLaserBatch> out;
  std::vector<Fault> faults;
  LaserClock clock;
  std::size_t offered = 0;
  const SimulatedLaser& laser;

  LaserCourse(Drive& drive, SimulatedLaser& simulated, LaserClock::Config config = {})
      : clock([&] {
          config.sensor = kLaser;
          return config;
        }()),
        laser(simulated) {
    drive.pps(gaussian(3));
    drive.labels(kPos, late(30, 20));
    drive.ins(20, late(4, 2));
    simulated.run(drive);
    HostClockModel::Config host_config;
    host_config.pps = kPps;
    host_config.label.trusted = kPos;
    HostClockModel host(host_config);
    for (auto& [received, m] : drive.stream.sorted()) {
      host.advance(received);
      if (auto* edge = std::get_if<PpsEdge>(&m)) host.add(*edge);
      if (auto* label = std::get_if<TimeLabel>(&m)) host.add(*label);
      if (auto* solution = std::get_if<InsSolution>(&m))
        host.add(TimedArrival{solution->sensor, solution->received, solution->time});
      if (auto* status = std::get_if<LaserStatus>(&m)) clock.add(*status);
      if (auto* batch = std::get_if<LaserBatch>(&m); batch && host.can_stamp()) {
        ++offered;
        clock.process(*batch, host, out);
      }
      clock.drain(faults);
    }
    clock.flush(out);
    clock.drain(faults);
  }
  nanoseconds error(const StampedLaserBatch& b) const { return b.time - laser.truth.at(b.packet_sequence); }
  void expect_all_within(nanoseconds limit) const {
    EXPECT_EQ(out.size(), offered) << "a batch was lost";
    for (const auto& b : out) ASSERT_LE(std::abs(error(b).count()), limit.count()) << b.packet_sequence;
  }
  void expect_within_sigmas(double n) const {
    EXPECT_EQ(out.size(), offered) << "a batch was lost";
    for (const auto& b : out)
      ASSERT_LE(std::abs(error(b).count()), n * static_cast<double>(b.sigma.count()) + 1000) << b.packet_sequence;
  }
  std::string details(FaultKind kind) const {
    std::string all;
    for (const Fault& f : faults)
      if (f.kind == kind) all += f.detail + "\n";
    return all;
  }
};

/// So shortly before a UTC hour that a drive of a minute crosses it.
GpsTime before_the_hour() { return *from_utc({2024, 5, 6, 13, 59, 30, 250'000'000}); }

TEST(LaserClock, GivenADisciplinedScannerWhenTheUtcHourTurnsThenTimeGoesOn) {
  Drive drive(before_the_hour(), seconds(60));
  SimulatedLaser laser;
  LaserCourse run(drive, laser);
  run.expect_all_within(us(1));
  EXPECT_GT(run.out.back().time, before_the_hour() + seconds(50));
  for (const auto& b : run.out) ASSERT_EQ(b.state, SyncState::Locked);
  EXPECT_TRUE(run.faults.empty());
}

TEST(LaserClock, GivenTheHourTurnWithPacketsLateThenEachKeepsItsOwnHour) {
  Drive drive(before_the_hour(), seconds(60));
  SimulatedLaser laser;
  laser.latency = [](Random& r, GpsTime) { return ms(1.45 + (r.uniform() < 0.3 ? 60 : 0)); };
  LaserCourse run(drive, laser);
  run.expect_all_within(us(1));
}

TEST(LaserClock, GivenAnyKindOfStampWhenACounterBeginsAnewThenTimeGoesOn) {
  for (const StampKind& kind : stamp_kinds()) {
    SCOPED_TRACE(kind.name);
    Drive drive(kind.begins_anew - seconds(30) + ms(250), seconds(60));
    SimulatedLaser laser;
    laser.stamp = kind.stamp;
    laser.latency = [](Random& r, GpsTime) { return ms(1.45 + (r.uniform() < 0.3 ? 60 : 0)); };
    LaserCourse run(drive, laser);
    run.expect_all_within(us(1));
    EXPECT_GT(run.out.back().time, kind.begins_anew + seconds(20));
    EXPECT_THAT(run.faults, testing::IsEmpty());
  }
}

TEST(LaserClock, GivenAnyKindOfStampOffByWholeSecondsThenItIsCorrected) {
  for (const StampKind& kind : stamp_kinds()) {
    SCOPED_TRACE(kind.name);
    Drive drive(kind.begins_anew - seconds(20) + ms(250), seconds(40));
    SimulatedLaser laser;
    laser.stamp = kind.stamp;
    laser.clock_error = [](GpsTime) { return seconds(-18); };
    LaserCourse run(drive, laser);
    run.expect_all_within(us(1));
    EXPECT_EQ(run.clock.correction(), seconds(18));
  }
}

TEST(LaserClock, GivenAFreeCounterOf32BitsThatNobodyToldTheTimeWhenItBeginsAnewThenArrivalsGoOnTelling) {
  Drive drive(some_begin(), seconds(90));
  SimulatedLaser laser;
  laser.stamp = counts(k32Bits_us, CounterOrigin::Own);
  laser.clock = [](GpsTime) { return SyncState::Unlocked; };
  const GpsTime wrap = some_begin() + seconds(50) + ms(123);  // 22 ppm fast
  laser.clock_error = [=](GpsTime t) {
    return of_unix(400'000 * k32Bits_us) - wrap + nanoseconds(static_cast<std::int64_t>(to_seconds(t - wrap) * 22e3));
  };
  LaserCourse run(drive, laser);
  run.expect_within_sigmas(3);
  for (const auto& b : run.out) {
    ASSERT_EQ(b.state, SyncState::Acquiring);
    ASSERT_LT(b.sigma, ms(3)) << to_seconds(b.time - wrap);
  }
  EXPECT_THAT(run.details(FaultKind::LabelConflict), testing::IsEmpty());
}

TEST(LaserClock, GivenPulsesButNoLabelThenTheCounterIsRightAndItsSecondsAreFound) {
  Drive drive(some_begin(), seconds(60));
  SimulatedLaser laser;
  laser.stamp = counts(k32Bits_us, CounterOrigin::Own);
  // The scanner is powered up at a whole second, so that its counter starts again during the drive. The period is not a
  // whole number of seconds.
  const GpsTime power_up = Drive::ceil_second(some_begin() + seconds(30)) - seconds(4294);
  laser.clock_error = [=](GpsTime) { return of_unix(400'000 * k32Bits_us) - power_up; };
  LaserCourse run(drive, laser);
  run.expect_all_within(us(2));
  for (const auto& b : run.out) ASSERT_EQ(b.state, SyncState::Locked);
}

/// Stamps since 1970 of a scanner whose PTP master names no scale.
Stamping since_1970() {
  return [](std::int64_t utc_ns) {
    return LaserCounter{CounterOrigin::Own, std::chrono::hours(876'000), nanoseconds(utc_ns)};
  };
}

TEST(LaserClock, GivenStampsSince1970OnAScaleThatNobodyNamesThenTheHostTellsTheSecondsAndItIsSaid) {
  // UTC, TAI by PTP, a master that is two years behind, and a receiver's date that is a day ahead.
  for (const int wrong_s : {0, 37, -74'986'812, 86'400}) {
    SCOPED_TRACE(wrong_s);
    Drive drive(some_begin(), seconds(40));
    SimulatedLaser laser;
    laser.stamp = since_1970();
    laser.clock_error = [=](GpsTime) { return seconds(wrong_s); };
    LaserCourse run(drive, laser);
    run.expect_all_within(us(1));
    EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("corrected"));
  }
}

/// A computer without a battery starts years behind, leads the scanner by PTP, and is set when it has satellites
/// (ouster-lidar/ouster-sdk#176).
TEST(LaserClock, GivenAMasterThatIsSetByYearsDuringTheDriveThenNoBatchIsWrong) {
  Drive drive(some_begin(), seconds(60));
  SimulatedLaser laser;
  laser.stamp = since_1970();
  const GpsTime set = some_begin() + seconds(30) + ms(7);
  laser.clock_error = [=](GpsTime t) { return t < set ? seconds(-77'768'078) + ms(22) : ms(0); };
  LaserCourse run(drive, laser);
  run.expect_within_sigmas(5);
  run.expect_all_within(ms(5));
  for (const auto& b : run.out) {
    if (b.time > set + seconds(5)) {
      ASSERT_LE(std::abs(run.error(b).count()), us(1).count()) << to_seconds(b.time - set);
    }
  }
  EXPECT_NE(run.details(FaultKind::LabelConflict), "");
}

/// Now and then one stamp is a second before 1970 (SICKAG/sick_scan_xd#411), or as late as a counter can be.
TEST(LaserClock, GivenSingleStampsThatAreNonsenseThenTheyGoByArrivalAndTheOthersStay) {
  for (const nanoseconds nonsense : {nanoseconds(seconds(-1)), nanoseconds(seconds(4'294'967'295))}) {
    SCOPED_TRACE(to_seconds(nonsense));
    Drive drive(some_begin(), seconds(60));
    SimulatedLaser laser;
    int stamped = 0, spoilt = 0;
    laser.stamp = [&](std::int64_t utc_ns) {
      const bool is_nonsense = ++stamped % 500 == 0;
      spoilt += is_nonsense;
      return LaserCounter{CounterOrigin::Utc, std::chrono::hours(876'000),
                          is_nonsense ? nonsense : nanoseconds(utc_ns)};
    };
    LaserCourse run(drive, laser);
    ASSERT_GT(spoilt, 3);
    run.expect_within_sigmas(5);
    int rough = 0;
    for (const auto& b : run.out) {
      rough += std::abs(run.error(b).count()) > us(1).count();
      ASSERT_LE(std::abs(run.error(b).count()), ms(5).count());
    }
    EXPECT_LE(rough, spoilt) << "sound stamps were left";
    EXPECT_EQ(run.clock.correction(), seconds(0));
  }
}

class WholeSeconds : public testing::TestWithParam<int> {};

TEST_P(WholeSeconds, GivenAScannerOffByWholeSecondsFromTheStartThenItIsCorrectedAndSaid) {
  Drive drive(some_begin(), seconds(40));
  SimulatedLaser laser;
  laser.clock_error = [](GpsTime) { return seconds(GetParam()); };
  LaserCourse run(drive, laser);
  run.expect_all_within(us(1));
  EXPECT_EQ(run.clock.correction(), seconds(-GetParam()));
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("corrected"));
}
// A scanner that is fed the wrong sentences counts within the hour from a beginning up to half an hour away.
INSTANTIATE_TEST_SUITE_P(LaserClock, WholeSeconds, testing::Values(-1700, -37, -18, -1, 1, 18, 37, 900, 1500));

TEST(LaserClock, GivenALabelThatSlipsASecondAndBackDuringTheDriveThenNoBatchIsWrong) {
  Drive drive(some_begin(), seconds(60));
  const GpsTime slip = some_begin() + seconds(25), back = some_begin() + seconds(40);
  SimulatedLaser laser;
  laser.clock_error = [=](GpsTime t) { return t > slip && t < back ? seconds(-1) : seconds(0); };
  LaserCourse run(drive, laser);
  run.expect_all_within(us(1));
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("off by one"));
  EXPECT_THAT(run.details(FaultKind::LabelConflict), Not(HasSubstr("phase")));
  EXPECT_EQ(run.clock.correction(), seconds(0));
}

TEST(LaserClock, GivenASlipTooShortToJudgeThenItsBatchesGoByArrival) {
  for (const int slip_s : {-1, 1}) {
    Drive drive(some_begin(), seconds(60));
    const GpsTime slip = some_begin() + seconds(25), back = slip + ms(400);
    SimulatedLaser laser;
    laser.clock_error = [=](GpsTime t) { return t > slip && t < back ? seconds(slip_s) : seconds(0); };
    LaserCourse run(drive, laser);
    run.expect_within_sigmas(3);
    run.expect_all_within(ms(5));
    EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("came back"));
    EXPECT_EQ(run.clock.counts().by_arrival, 20u);
  }
}

TEST(LaserClock, GivenALeapSecondThatTheScannerDoesNotKnowThenTheHostCorrectsIt) {
  const GpsTime leap = *from_utc({2017, 1, 1, 0, 0, 0, 0});
  Drive drive(leap - seconds(30), seconds(60));
  SimulatedLaser laser;
  laser.leap = seconds(17);  // it stays so: the scanner is a second ahead of UTC afterwards
  LaserCourse run(drive, laser);
  run.expect_all_within(us(1));
}

TEST(LaserClock, GivenHalfASecondWrongThenItIsNotCorrectedButStampedByArrivalAndSaid) {
  Drive drive(some_begin(), seconds(40));
  SimulatedLaser laser;
  laser.clock_error = [](GpsTime) { return ms(-500); };
  LaserCourse run(drive, laser);
  run.expect_within_sigmas(4);
  run.expect_all_within(ms(4));
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("by arrival"));
  EXPECT_EQ(run.out.back().state, SyncState::Acquiring);
  EXPECT_EQ(run.clock.correction(), seconds(0));
}

TEST(LaserClock, GivenHalfASecondWrongForAWhileThenItIsBelievedAgainAfterwards) {
  Drive drive(some_begin(), seconds(40));
  SimulatedLaser laser;
  const GpsTime wrong = some_begin() + seconds(15), right = some_begin() + seconds(20);
  laser.clock_error = [&](GpsTime t) { return t >= wrong && t < right ? ms(500) : ms(0); };
  LaserCourse run(drive, laser);
  run.expect_within_sigmas(5);
  for (const auto& b : run.out) {
    const bool is_settled = b.time < wrong - ms(100) || b.time > right + ms(2300);
    if (is_settled && b.time > some_begin() + seconds(8)) {
      ASSERT_EQ(b.state, SyncState::Locked) << to_seconds(b.time - some_begin());
    }
  }
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("agrees with the host clock again"));
}

TEST(LaserClock, GivenAScannerThatNeverHadPpsThenArrivalTellsAndSigmaIsTrue) {
  Drive drive(some_begin(), seconds(120));
  SimulatedLaser laser;
  laser.clock = [](GpsTime) { return SyncState::Unlocked; };
  laser.clock_error = [](GpsTime t) {  // powered up at some time, 35 ppm fast
    return seconds(1234) + ms(777) + nanoseconds(static_cast<std::int64_t>(to_seconds(t - some_begin()) * 35e3));
  };
  LaserCourse run(drive, laser);
  run.expect_within_sigmas(3);
  for (const auto& b : run.out) {
    ASSERT_EQ(b.state, SyncState::Acquiring);
    ASSERT_LT(b.sigma, ms(3));
  }
  EXPECT_THAT(run.details(FaultKind::NoTime), HasSubstr("not held by PPS"));
}

TEST(LaserClock, GivenPpsLostInTheScannerThenItHoldsOverThenGoesByArrival) {
  Drive drive(some_begin(), seconds(150));
  const GpsTime lost = some_begin() + seconds(30);
  SimulatedLaser laser;
  laser.clock = [=](GpsTime t) { return t > lost ? SyncState::Unlocked : SyncState::Locked; };
  laser.clock_error = [=](GpsTime t) {  // 15 ppm from the time at which it runs free
    return nanoseconds(t > lost ? static_cast<std::int64_t>(to_seconds(t - lost) * 15e3) : 0);
  };
  LaserCourse run(drive, laser);
  run.expect_within_sigmas(3.5);
  EXPECT_GT(run.clock.counts().holdover, 500u);
  EXPECT_GT(run.clock.counts().by_arrival, 500u);
}

TEST(LaserClock, GivenAStalledNetworkThenLatePacketsKeepTheirTime) {
  Drive drive(some_begin(), seconds(60));
  SimulatedLaser laser;
  // Nothing is delivered for 0.8 s, then everything at once.
  const GpsTime stall = some_begin() + seconds(30);
  laser.latency = [=](Random&, GpsTime t) {
    const nanoseconds into = t - stall;
    return into > nanoseconds(0) && into < ms(800) ? ms(802) - into : ms(1.5);
  };
  LaserCourse run(drive, laser);
  run.expect_all_within(us(1));
  EXPECT_EQ(run.clock.correction(), seconds(0));
}

TEST(LaserClock, GivenSettingsOutOfRangeThenTheSentenceNamesTheKey) {
  LaserClock::Config config;
  EXPECT_EQ(config.validate(), "");
  config.discipline.drift_ppm = -1;
  EXPECT_THAT(config.validate(), HasSubstr("drift_ppm"));
}

}  // namespace
}  // namespace hueline::sync
