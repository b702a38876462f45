#include "sync/exposure_matcher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/sync/camera_course.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;
using testing::HasSubstr;

TEST(ExposureMatcher, GivenAllMarksAndImagesThenEachGetsItsOwn) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_TRUE(run.faults.empty());
}

/// Durations of automatic exposure, from 0.1 to 12 ms.
nanoseconds chosen_by_camera(int i) { return us(100 + (i * 977) % 11'900); }

TEST(ExposureMatcher, GivenReportedExposuresThenTheMiddleIsThatOfEach) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.reported = [](int i) { return std::vector{chosen_by_camera(i)}; };
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_TRUE(run.faults.empty());
  for (const Exposure& e : run.out) EXPECT_EQ(e.duration, e.image.reported.at(0).duration);
}

TEST(ExposureMatcher, GivenACameraThatMustReportThenImagesWithoutReportHaveNoTime) {
  Drive drive(some_begin(), seconds(20));
  SimulatedCamera camera;
  camera.reported = [](int i) { return i % 10 == 3 ? std::vector<nanoseconds>() : std::vector{chosen_by_camera(i)}; };
  ExposureMatcher::Config config = matcher_config();
  config.must_report = true;
  CameraCourse run(drive, camera, config);
  EXPECT_GT(run.counts().unmatched, 10u);
  EXPECT_EQ(run.counts().by_mark + run.counts().unmatched, camera.truth.size());
  EXPECT_EQ(run.count(FaultKind::NoTime), run.counts().unmatched);
  for (const Exposure& e : run.out) EXPECT_EQ(e.timing == ExposureTiming::Unmatched, e.image.reported.empty());
  EXPECT_THAT(run.faults.at(0).detail, HasSubstr("does not report this one"));
}

TEST(ExposureMatcher, GivenLensesThatExposeDifferentlyThenTheMiddleIsThatOfTheirMean) {
  Drive drive(some_begin(), seconds(10));
  SimulatedCamera camera;
  camera.reported = [](int) { return std::vector<nanoseconds>{ms(1), ms(3), ms(8)}; };
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  for (const Exposure& e : run.out) EXPECT_EQ(e.duration, ms(4));
}

TEST(ExposureMatcher, GivenACounterThatIsReadAtTheEndThenChangingExposuresDoNotDisturbIt) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.reported = [](int i) { return std::vector{chosen_by_camera(i)}; };
  camera.stamped_at = 1;
  camera.mark_lost = [](int i) { return i % 17 == 9; };
  ExposureMatcher::Config config = matcher_config();
  config.stamp_event = ExposureMatcher::StampEvent::ExposureEnd;
  CameraCourse run(drive, camera, config);
  EXPECT_EQ(run.counts().by_mark + run.counts().by_camera_clock, camera.truth.size());
  for (const Exposure& e : run.out) {
    if (e.timing == ExposureTiming::CameraClock) {
      EXPECT_LT(e.sigma, us(200));
    }
  }
}

TEST(ExposureMatcher, GivenACounterThatIsGpsTimeThenReportedExposuresLeadToTheMiddle) {
  Drive drive(some_begin(), seconds(20));
  SimulatedCamera camera;
  camera.reported = [](int i) { return std::vector{chosen_by_camera(i)}; };
  camera.stamped_at = 1;
  camera.clock_ppm = 0;
  camera.mark_lost = [](int) { return true; };
  ExposureMatcher::Config config = matcher_config();
  config.mark_input = 0;
  config.stamp_event = ExposureMatcher::StampEvent::ExposureEnd;
  config.counter_offset = (drive.begin - seconds(1000)).time_since_epoch();
  config.relation.clock_sigma = us(3);
  CameraCourse run(drive, camera, config);
  EXPECT_EQ(run.counts().by_camera_clock, camera.truth.size());
}

TEST(ExposureMatcher, GivenAShortDriveOfASlowCameraThenItsFewImagesGetTheirMarks) {
  Drive drive(some_begin(), seconds(9));
  SimulatedCamera camera;
  camera.rate_hz = 1;
  CameraCourse run(drive, camera);
  EXPECT_EQ(camera.truth.size(), 8u);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_TRUE(run.faults.empty());
}

TEST(ExposureMatcher, GivenFewImagesThatTwoMarksMayBelongToThenNoneIsGuessed) {
  Drive drive(some_begin(), seconds(2));
  SimulatedCamera camera;
  camera.rate_hz = 7;
  ExposureMatcher::Config config = matcher_config();
  config.latency_max = ms(250);  // more than the interval
  CameraCourse run(drive, camera, config);
  EXPECT_GE(camera.truth.size(), 5u);
  EXPECT_LT(camera.truth.size(), 10u);
  EXPECT_EQ(run.counts().by_mark, 0u);
  EXPECT_EQ(run.counts().unmatched, camera.truth.size());
}

TEST(ExposureMatcher, GivenLostMarksThenTheCameraClockTellsWithGrownSigma) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.mark_lost = [](int i) { return i % 17 == 9 || (i > 200 && i < 260); };
  CameraCourse run(drive, camera);
  std::uint64_t lost = 0;
  for (int i = 0; i < camera.exposures; ++i) lost += camera.mark_lost(i) ? 1 : 0;
  EXPECT_EQ(run.counts().by_camera_clock, lost);
  EXPECT_EQ(run.counts().lost_marks, lost);
  EXPECT_EQ(run.count(FaultKind::Lost), lost);
  for (const Exposure& e : run.out)
    if (e.timing == ExposureTiming::CameraClock) {
      EXPECT_GT(e.sigma, us(3));
      EXPECT_LT(e.sigma, us(200));
      EXPECT_EQ(e.state, SyncState::Holdover);
    }
}

TEST(ExposureMatcher, GivenLostImagesThenTheirMarksAreNotGivenToOthers) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.image_lost = [](int i) { return i % 13 == 5 || (i > 100 && i < 120); };
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_EQ(run.counts().lost_images, static_cast<std::uint64_t>(camera.exposures) - camera.truth.size());
  EXPECT_EQ(run.counts().marks_of_lost_images, run.counts().lost_images);
  EXPECT_EQ(run.counts().spurious_marks, 0u);
}

TEST(ExposureMatcher, GivenSpuriousMarksThenTheyAreNamedAndNotUsed) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  Random random(5);
  for (GpsTime t = drive.begin + seconds(2); t < drive.end - seconds(3); t += ms(700))
    camera.spurious.push_back(t + ms(random.uniform(0, 300)));
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_EQ(run.counts().spurious_marks, camera.spurious.size());
  EXPECT_EQ(run.count(FaultKind::Spurious), camera.spurious.size());
}

TEST(ExposureMatcher, GivenBouncedMarksThenTheFirstEdgeCounts) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.mark_copies = [](int i) { return i % 5 == 2 ? 2 : 1; };
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_EQ(run.counts().bounced_marks + run.counts().spurious_marks,
            static_cast<std::uint64_t>((camera.exposures + 2) / 5));
}

TEST(ExposureMatcher, GivenLateImagesThenTheyGetTheMarkOfTheirExposureNotOfTheirArrival) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.extra_latency = [](int i) { return i % 40 > 35 ? ms(430) : ms(0); };
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_EQ(run.counts().unmatched, 0u);
}

TEST(ExposureMatcher, GivenLateImagesFromTheVeryStartThenNoneGetsAWrongMark) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Drive drive(some_begin(), seconds(20), {}, seed);
    SimulatedCamera camera;
    Random random(seed);
    std::vector<double> extra;
    for (int i = 0; i < 300; ++i) extra.push_back(i < 8 ? random.uniform(0, 220) : 0);
    camera.extra_latency = [&](int i) { return ms(extra[static_cast<std::size_t>(i)]); };
    CameraCourse run(drive, camera);
    EXPECT_GT(run.counts().by_mark, camera.truth.size() / 2);
  }
}

TEST(ExposureMatcher, GivenRepeatedImagesThenOnlyTheFirstCounts) {
  Drive drive(some_begin(), seconds(30));
  SimulatedCamera camera;
  camera.image_copies = [](int i) { return i % 10 == 3 ? 2 : 1; };
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().by_mark, static_cast<std::uint64_t>(camera.exposures));
  EXPECT_EQ(run.counts().repeated_images, camera.truth.size() - static_cast<std::uint64_t>(camera.exposures));
  EXPECT_EQ(run.count(FaultKind::Spurious), run.counts().repeated_images);
}

TEST(ExposureMatcher, GivenACameraRestartThenItsNewNumbersAreLearnt) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.restart_at = 300;
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().restarts, 1u);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_EQ(run.count(FaultKind::ClockStep), 1u);
}

TEST(ExposureMatcher, GivenNoMarksAtAllThenEveryImageIsUnmatchedAndSaid) {
  Drive drive(some_begin(), seconds(30));
  SimulatedCamera camera;
  camera.mark_lost = [](int) { return true; };
  CameraCourse run(drive, camera);
  EXPECT_EQ(run.counts().unmatched, camera.truth.size());
  EXPECT_EQ(run.count(FaultKind::NoTime), camera.truth.size());
}

TEST(ExposureMatcher, GivenALatencyWiderThanTheIntervalOfAPeriodicCameraThenItDoesNotGuess) {
  Drive drive(some_begin(), seconds(20));
  SimulatedCamera camera;
  ExposureMatcher::Config config = matcher_config();
  config.latency_max = ms(320);
  CameraCourse run(drive, camera, config);
  EXPECT_EQ(run.counts().by_mark, 0u);
  EXPECT_EQ(run.counts().unmatched, camera.truth.size());
}

TEST(ExposureMatcher, GivenALatencyWiderThanTheIntervalButIrregularTriggersThenTheRelationIsFound) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.interval_wobble = ms(40);
  ExposureMatcher::Config config = matcher_config();
  config.latency_max = ms(320);
  CameraCourse run(drive, camera, config);
  EXPECT_GT(run.counts().by_mark, camera.truth.size() * 95 / 100);
}

TEST(ExposureMatcher, GivenACameraWithoutCounterThenTheArrivalWindowDecides) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  camera.mark_lost = [](int i) { return i % 17 == 9; };
  camera.image_lost = [](int i) { return i % 13 == 5; };
  ExposureMatcher::Config config = matcher_config();
  config.has_counter = false;
  CameraCourse run(drive, camera, config);
  EXPECT_GT(run.counts().by_mark, camera.truth.size() * 9 / 10);
  EXPECT_GT(run.counts().unmatched, 30u);
}

TEST(ExposureMatcher, GivenNoStrobeWireThenTheCameraClockIsTiedByItsFastestDeliveries) {
  Drive drive(some_begin(), seconds(60));
  SimulatedCamera camera;
  ExposureMatcher::Config config = matcher_config();
  config.mark_input = 0;
  config.strobe_delay = nanoseconds(0);
  config.latency_min = ms(25);
  config.latency_max = ms(35);
  config.stamp_event = ExposureMatcher::StampEvent::ExposureStart;
  camera.strobe_delay = nanoseconds(0);
  CameraCourse run(drive, camera, config);
  EXPECT_EQ(run.counts().by_camera_clock, camera.truth.size());
  for (const Exposure& e : run.out) {
    EXPECT_LT(e.sigma, ms(20));
  }
}

/// A camera on PTP: its counter is TAI since 1970 and names the end of exposure plus 45 us.
struct DisciplinedCamera : SimulatedCamera {
  DisciplinedCamera(Drive& drive, seconds wrong) {
    strobe_delay = nanoseconds(0);
    run(drive);
    for (auto& item : drive.stream.sorted())
      if (auto* image = std::get_if<Image>(&item.second)) {
        const GpsTime end = truth.at(image->packet_sequence) + exposure / 2;
        image->time = DeviceTime<CameraCounter>(end.time_since_epoch() + seconds(315'964'819) + wrong + us(45));
      }
    drive.end = drive.begin;  // CameraCourse adds nothing
  }
};
ExposureMatcher::Config disciplined_config() {
  ExposureMatcher::Config config = matcher_config();
  config.mark_input = 0;
  config.strobe_delay = nanoseconds(0);
  config.counter_offset = seconds(-315'964'819);
  config.stamp_event = ExposureMatcher::StampEvent::ExposureEnd;
  config.stamp_delay = us(45);
  config.relation.clock_sigma = us(8);
  return config;
}

TEST(ExposureMatcher, GivenACameraOnPtpThenItsOwnClockTellsTheTime) {
  Drive drive(some_begin(), seconds(30));
  DisciplinedCamera camera(drive, seconds(0));
  CameraCourse run(drive, camera, disciplined_config());
  EXPECT_EQ(run.counts().by_camera_clock, camera.truth.size());
  for (const Exposure& e : run.out) EXPECT_EQ(e.exposure_mid, camera.truth.at(e.image.packet_sequence));
  EXPECT_TRUE(run.faults.empty());
}

TEST(ExposureMatcher, GivenAPtpClockInUtcThenItIsRefusedAndSaid) {
  Drive drive(some_begin(), seconds(30));
  DisciplinedCamera camera(drive, seconds(-37));
  CameraCourse run(drive, camera, disciplined_config());
  EXPECT_EQ(run.counts().unmatched, camera.truth.size());
  EXPECT_EQ(run.count(FaultKind::LabelConflict), camera.truth.size());
}

TEST(ExposureMatcher, GivenACounterThatWrapsThenMatchingGoesOn) {
  Drive drive(some_begin(), seconds(400));
  SimulatedCamera camera;
  camera.rate_hz = 4;
  camera.stamp_jitter_us = 40;
  camera.run(drive);
  for (auto& item : drive.stream.sorted())
    if (auto* image = std::get_if<Image>(&item.second)) {
      const std::int64_t tick = count_ns(image->time) / 125'000 * 125'000;  // Ladybug5 on USB
      image->time = DeviceTime<CameraCounter>(nanoseconds(tick % 128'000'000'000));
    }
  ExposureMatcher::Config config = matcher_config();
  config.counter_wraps = seconds(128);
  config.relation.clock_sigma = us(60);
  SimulatedCamera silent;
  silent.truth = camera.truth;
  silent.exposures = camera.exposures;
  // All data have been given already; this camera adds nothing of its own.
  drive.end = drive.begin;
  CameraCourse run(drive, silent, config);
  EXPECT_EQ(run.counts().by_mark, camera.truth.size());
  EXPECT_EQ(run.counts().restarts, 0u);
}

class EverythingAtOnce : public testing::TestWithParam<std::uint64_t> {};

TEST_P(EverythingAtOnce, NoImageGetsAWrongMark) {
  Drive drive(some_begin(), seconds(120), {}, GetParam());
  Random random(GetParam() * 31);
  std::vector<double> dice;
  for (int i = 0; i < 5000; ++i) dice.push_back(random.uniform());
  const auto roll = [&](int i, int salt) { return dice[static_cast<std::size_t>(i * 7 + salt) % dice.size()]; };
  SimulatedCamera camera;
  camera.mark_lost = [&](int i) { return roll(i, 1) < 0.05; };
  camera.image_lost = [&](int i) { return roll(i, 2) < 0.05; };
  camera.mark_copies = [&](int i) { return roll(i, 3) < 0.05 ? 2 : 1; };
  camera.image_copies = [&](int i) { return roll(i, 4) < 0.02 ? 2 : 1; };
  camera.extra_latency = [&](int i) { return roll(i, 5) < 0.05 ? ms(300 * roll(i, 6)) : ms(0); };
  camera.restart_at = 500;
  for (int i = 0; i < 60; ++i) camera.spurious.push_back(drive.begin + ms(random.uniform(2000, 117000)));
  CameraCourse run(drive, camera);
  EXPECT_GT(run.counts().by_mark, camera.truth.size() * 85 / 100);
  EXPECT_LT(run.counts().unmatched, camera.truth.size() / 20);
}
INSTANTIATE_TEST_SUITE_P(ExposureMatcher, EverythingAtOnce, testing::Range<std::uint64_t>(1, 13));

TEST(ExposureMatcher, GivenSettingsOutOfRangeThenTheSentenceNamesTheKey) {
  ExposureMatcher::Config config = matcher_config();
  config.latency_max = config.latency_min;
  EXPECT_THAT(config.validate(), HasSubstr("latency_max"));
  config = matcher_config();
  config.mark_input = 0;
  config.has_counter = false;
  EXPECT_THAT(config.validate(), HasSubstr("has_counter"));
}

}  // namespace
}  // namespace hueline::sync
