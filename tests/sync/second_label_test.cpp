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

TEST(SecondLabel, GivenLabelsNineTenthsOfASecondLateThenTheSecondIsRight) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, [](Random& r, GpsTime) { return ms(900 + r.uniform(0, 90)); });
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  run.expect_never_wrong_by(us(100));
}

TEST(SecondLabel, GivenLabelsAlwaysMoreThanASecondLateThenArrivalsSettleIt) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, [](Random& r, GpsTime) { return ms(1200 + r.uniform(0, 100)); });
  drive.ins(20, late(4, 2));
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_EQ(run.count(FaultKind::LabelConflict), 0u) << "late is not wrong";
  run.expect_never_wrong_by(us(100));
}

TEST(SecondLabel, GivenLabelsNowAndThenMoreThanASecondLateThenLabelsAloneSuffice) {
  Drive drive(some_begin(), seconds(200));
  drive.pps(gaussian(3));
  drive.labels(kPos, [](Random& r, GpsTime) { return ms(r.uniform() < 0.4 ? 1200 : 300); });
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  run.expect_never_wrong_by(us(100));
}

TEST(SecondLabel, GivenLabelsAloneWhenTheRigForbidsThemThenItDoesNotLock) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(1200, 20));
  HostClockModel::Config config = clock_config();
  config.label.allow_labels_alone = false;
  Course run(drive, config);
  EXPECT_EQ(run.model.state(), SyncState::Acquiring);
  EXPECT_FALSE(run.model.can_stamp());
}

TEST(SecondLabel, GivenTheReceiversOwnLabelsOffByOneThenArrivalsWinAndItIsSaid) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20), constant(seconds(1)));
  drive.ins(20, late(4, 2));
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("off by one"));
  run.expect_never_wrong_by(us(100));
}

struct WrongSource {
  const char* name;
  std::int64_t shift_s;
  const char* said;
};
class SecondSourceIsWrong : public testing::TestWithParam<WrongSource> {};

TEST_P(SecondSourceIsWrong, GivenATrustedPosThenItStaysWithThePosAndSaysSo) {
  Drive drive(some_begin(), seconds(60));
  usual(drive);
  drive.labels(kOther, late(30, 20), constant(seconds(GetParam().shift_s)));
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr(GetParam().said));
  run.expect_never_wrong_by(us(100));
}

TEST_P(SecondSourceIsWrong, GivenNobodyTrustedThenItDoesNotLock) {
  Drive drive(some_begin(), seconds(60));
  usual(drive);
  drive.labels(kOther, late(30, 20), constant(seconds(GetParam().shift_s)));
  HostClockModel::Config config = clock_config();
  config.label.trusted = kSystemSensor;
  Course run(drive, config);
  run.expect_never_wrong_by(us(100));
  // A source with a time before any possible drive is ignored. Any other difference leaves the second open.
  EXPECT_EQ(run.model.state(), GetParam().shift_s < -1'000'000 ? SyncState::Locked : SyncState::Acquiring);
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(SecondLabel, SecondSourceIsWrong,
                         testing::Values(WrongSource{"utc", -18, "UTC"}, WrongSource{"tai_for_utc", 37, "TAI"},
                                         WrongSource{"tai", 19, "TAI"}, WrongSource{"off_by_one", 1, "off by one"},
                                         WrongSource{"rollover", -1024 * kSecondsPerWeek, "rolled over"},
                                         WrongSource{"wrong_week", kSecondsPerWeek, "wrong week"},
                                         WrongSource{"local_time", 7200, "local time"}),
                         [](const auto& each) { return std::string(each.param.name); });

TEST(SecondLabel, GivenTheOnlySourceRolledOverThenItNeverLocks) {
  Drive drive(some_begin(), seconds(60));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20), constant(seconds(-1024 * kSecondsPerWeek)));
  Course run(drive, clock_config());
  EXPECT_FALSE(run.model.can_stamp());
  EXPECT_THAT(run.details(FaultKind::LabelConflict), HasSubstr("rolled over"));
}

TEST(SecondLabel, GivenTheEndOfAGpsWeekThenNothingHappens) {
  Drive drive(from_gps_week(2300, seconds(kSecondsPerWeek - 60) + ms(250)), seconds(120));
  usual(drive);
  Course run(drive, clock_config());
  EXPECT_TRUE(run.faults.empty());
  EXPECT_EQ(run.model.state(), SyncState::Locked);
  EXPECT_EQ(to_gps_week(run.samples.back().stamp->time).week, 2301);
  run.expect_never_wrong_by(us(60));
}

TEST(SecondLabel, GivenALeapSecondThenGpsTimeGoesOnAndTheOffsetStepsWithTheTable) {
  const GpsTime leap = *from_utc({2017, 1, 1, 0, 0, 0, 0});
  Drive drive(leap - seconds(100), seconds(200));
  usual(drive);
  Course run(drive, clock_config());
  EXPECT_TRUE(run.faults.empty());
  run.expect_never_wrong_by(us(60));
  EXPECT_EQ(run.model.utc_offset(leap - seconds(2)), seconds(17));
  EXPECT_EQ(run.model.utc_offset(leap), seconds(18));
}

TEST(SecondLabel, GivenAReceiverWithoutAlmanacThenItsUtcOffsetIsRefused) {
  HostClockModel model(clock_config());
  model.add(TimeLabel{kPos, host_time_ns(5), GpsTime(std::chrono::ceil<seconds>(some_begin().time_since_epoch())),
                      seconds(16), true});
  std::vector<Fault> faults;
  model.drain(faults);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].kind, FaultKind::LabelConflict);
  EXPECT_EQ(model.utc_offset(some_begin()), seconds(18));
  // One second more than the table is a leap second that the table does not contain yet.
  model.add(TimeLabel{kPos, host_time_ns(6), GpsTime(std::chrono::ceil<seconds>(some_begin().time_since_epoch())),
                      seconds(19), true});
  EXPECT_EQ(model.utc_offset(some_begin()), seconds(19));
}

TEST(SecondLabel, GivenInvalidLabelsThenTheyAreCountedAndNotUsed) {
  Drive drive(some_begin(), seconds(30));
  drive.pps(gaussian(3));
  drive.labels(kPos, late(30, 20));
  for (auto& item : drive.stream.sorted())
    if (auto* label = std::get_if<TimeLabel>(&item.second)) label->is_valid = false;
  Course run(drive, clock_config());
  EXPECT_EQ(run.model.counts().invalid_labels, 30u);
  EXPECT_FALSE(run.model.can_stamp());
}

}  // namespace
}  // namespace hueline::sync
