#include "sync/self_timed_laser.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sync/simulated_rig.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;
using testing::HasSubstr;

/// A scanner that was read from a file: ten packets and a status each second, by its own clock.
struct Course {
  HostClockModel leaps{HostClockModel::Config{}};
  SelfTimedLaser clock;
  std::vector<StampedLaserBatch> out;
  std::vector<Fault> faults;
  std::vector<GpsTime> truth;
  GpsTime now;
  const HostTime first = host_time_ns(123'000'000'000);  // the clock of some recorder
  const GpsTime begin = now;
  SyncState says = SyncState::Locked;
  Stamping stamp = counts(std::chrono::hours(1));
  bool labels = true;
  nanoseconds label_error{0}, stamp_error{0};

  explicit Course(SelfTimedLaser::Config config = {}, GpsTime from = *from_utc({2024, 5, 6, 13, 59, 50, 0}))
      : clock([&] {
          config.sensor = kLaser;
          return config;
        }()),
        now(from) {}
  HostTime received() const { return first + (now - begin); }
  LaserTime stamped() const { return stamp(count_ns(now - seconds(18) + stamp_error) + 315'964'800'000'000'000); }
  void drive(int length_s) {
    for (int i = 0; i < 10 * length_s; ++i, now += ms(100)) {
      if (i % 10 == 2) {
        clock.add(LaserStatus{kLaser, received(), stamped(), says, "as simulated"}, leaps, out);
        const GpsTime second(std::chrono::floor<seconds>(now.time_since_epoch()));
        if (labels)
          clock.add(TimeLabel{kLaser, received(), second + label_error, {}, says == SyncState::Locked}, leaps, out);
      }
      LaserBatch batch{kLaser, received(), truth.size(), stamped(), std::vector<LaserReturn>(7)};
      truth.push_back(now);
      clock.process(std::move(batch), leaps, out);
      clock.advance(received(), leaps, out);
    }
  }
  void end() {
    clock.flush(leaps, out);
    clock.drain(faults);
  }
  std::uint64_t untimed() const {
    const auto& c = clock.counts();
    return c.never_locked + c.lost_lock + c.no_label + c.astray;
  }
  void expect_accounted() const { EXPECT_EQ(7 * out.size() + untimed(), 7 * truth.size()); }
  void expect_true() const {
    for (const auto& b : out) ASSERT_EQ(b.time, truth.at(b.packet_sequence)) << b.packet_sequence;
  }
};

TEST(SelfTimedLaser, GivenPpsAndLabelsThenItsOwnCounterIsGpsTimeFromTheFirstPacketOn) {
  Course run;
  run.drive(30);  // the UTC hour changes
  run.end();
  EXPECT_EQ(run.out.size(), run.truth.size());
  run.expect_true();
  for (const auto& b : run.out) {
    EXPECT_EQ(b.state, SyncState::Locked);
    EXPECT_EQ(b.sigma, us(2));
  }
  EXPECT_TRUE(run.faults.empty());
}

TEST(SelfTimedLaser, GivenAnyKindOfStampWhenACounterBeginsAnewThenItIsGpsTime) {
  for (const StampKind& kind : stamp_kinds()) {
    SCOPED_TRACE(kind.name);
    Course run({}, kind.begins_anew - us(10'000'000));
    run.stamp = kind.stamp;
    run.drive(30);
    run.end();
    EXPECT_EQ(run.out.size(), run.truth.size());
    run.expect_true();
    EXPECT_TRUE(run.faults.empty());
  }
}

TEST(SelfTimedLaser, GivenACounterThatNobodyToldTheTimeThenNothingIsPlaced) {
  Course run;
  run.stamp = counts(k32Bits_us, CounterOrigin::Own);
  run.drive(10);
  run.end();
  EXPECT_TRUE(run.out.empty());
  EXPECT_EQ(run.clock.counts().no_label, 7 * run.truth.size());
}

TEST(SelfTimedLaser, GivenAShortPeriodThenALabelOfAnotherOneIsNotFollowed) {
  Course run;
  run.stamp = counts(std::chrono::minutes(10));
  run.drive(10);
  run.label_error = std::chrono::minutes(20);
  run.drive(2);
  run.label_error = nanoseconds(0);
  run.drive(5);
  run.end();
  EXPECT_EQ(run.out.size(), run.truth.size());
  run.expect_true();
}

TEST(SelfTimedLaser, GivenASingleLabelThenTheEndOfTheFileSettlesIt) {
  Course run;
  run.drive(1);
  EXPECT_TRUE(run.out.empty());
  run.end();
  EXPECT_EQ(run.out.size(), run.truth.size());
  run.expect_true();
}

TEST(SelfTimedLaser, GivenALabelOfAnotherHourThenThoseAroundItAreBelieved) {
  Course run;
  run.label_error = std::chrono::hours(26);
  run.drive(1);
  run.label_error = nanoseconds(0);
  run.drive(20);
  run.label_error = -std::chrono::hours(1);
  run.drive(2);
  run.label_error = nanoseconds(0);
  run.drive(5);
  run.end();
  EXPECT_EQ(run.out.size(), run.truth.size());
  run.expect_true();
}

TEST(SelfTimedLaser, GivenAScannerWithoutPpsThenNothingIsPlacedAndTheReasonSaid) {
  Course run;
  run.says = SyncState::Unlocked;
  run.drive(60);
  run.end();
  EXPECT_TRUE(run.out.empty());
  EXPECT_EQ(run.clock.counts().never_locked, 7 * run.truth.size());
  ASSERT_FALSE(run.faults.empty());
  EXPECT_THAT(run.faults[0].detail, HasSubstr("PPS is locked"));
}

TEST(SelfTimedLaser, GivenPpsWithoutAnyLabelThenTheReasonIsTheHour) {
  Course run;
  run.labels = false;
  run.drive(60);
  run.end();
  EXPECT_TRUE(run.out.empty());
  EXPECT_EQ(run.clock.counts().no_label, 7 * run.truth.size());
}

TEST(SelfTimedLaser, GivenPpsThatIsLostThenItsCrystalHoldsWithGrowingSigmaUntilItIsNoGood) {
  Course run;
  run.drive(10);
  run.says = SyncState::Acquiring;
  run.drive(100);
  run.end();
  run.expect_accounted();
  run.expect_true();
  EXPECT_EQ(run.out.back().state, SyncState::Holdover);
  EXPECT_NEAR(to_seconds(run.out.back().time - run.begin), 60, 2);  // 1 ms at 20 ppm
  EXPECT_NEAR(to_seconds(run.out.back().sigma), 1e-3, 5e-5);
  EXPECT_GT(run.clock.counts().lost_lock, 0u);
  run.says = SyncState::Locked;
  run.drive(5);
  EXPECT_EQ(run.out.back().state, SyncState::Locked);
}

TEST(SelfTimedLaser, GivenACounterThatLeapsForAPacketThenItIsNotUsed) {
  Course run;
  run.drive(10);
  run.stamp_error = std::chrono::minutes(20);
  run.drive(1);
  run.stamp_error = nanoseconds(0);
  run.drive(5);
  run.end();
  run.expect_accounted();
  run.expect_true();
  EXPECT_EQ(run.clock.counts().astray, 70u);
}

TEST(SelfTimedLaser, GivenADateBeforeAnyDriveThenTheRolloverIsNamed) {
  SelfTimedLaser::Config config;
  config.not_before = *from_utc({2012, 1, 1, 0, 0, 0, 0});
  Course run(config);
  run.label_error = -std::chrono::seconds(1024 * kSecondsPerWeek);
  run.drive(5);
  run.end();
  EXPECT_TRUE(run.out.empty());
  std::string said;
  for (const Fault& fault : run.faults) said += fault.detail;
  EXPECT_THAT(said, HasSubstr("rolled over"));
}

}  // namespace
}  // namespace hueline::sync
