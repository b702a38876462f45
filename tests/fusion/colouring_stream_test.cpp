// Which exposure a point belongs to, and what happens if the stream lacks images, solutions, whole cameras or its
// order.
#include <gtest/gtest.h>

#include "fusion/colouring.hpp"
#include "tests/fusion/test_drive.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;

TEST(Windows, EachExposureOwnsHalfAnIntervalOnBothSides) {
  TestDrive test;
  test.config.neighbours = 0;
  const Outcome out = run(test);
  expect_every_return_accounted_for(out);
  for (const ColouredPoint& p : out.points) {
    if (p.state != ColourState::Direct) continue;
    const double t = to_seconds(p.time - at(0));
    EXPECT_EQ(p.exposure, static_cast<std::uint32_t>(std::floor((t - kFirstExposure) / kInterval + 0.5))) << t;
  }
  EXPECT_GT(count_state(out, ColourState::Direct), out.points.size() / 2);
  EXPECT_EQ(count_state(out, ColourState::Neighbour), 0u);
}

TEST(Provisional, EveryPointGetsAColourAtOnceAndTheFinalOnesDoNotDependOnIt) {
  for (const ExposureChoice choice : {ExposureChoice::Visible, ExposureChoice::Nearest}) {
    TestDrive test;
    test.config.choice = choice;
    test.until = 6;
    const Outcome without = run(test);
    test.is_provisional = true;
    for (const int threads : {1, 2}) {
      test.config.threads = threads;
      const Outcome with = run(test);
      EXPECT_EQ(with.points, without.points);
      ASSERT_EQ(with.provisional.size(), with.points.size());
      std::size_t coloured = 0, later = 0;
      for (std::size_t i = 0; i < with.points.size(); ++i) {
        const ColouredPoint &early = with.provisional[i], &final = with.points[i];
        ASSERT_EQ(early.time, final.time);
        ASSERT_EQ(early.east, final.east);
        coloured += early.exposure != kNoExposure;
        later += early.exposure != kNoExposure && final.exposure != kNoExposure && final.exposure > early.exposure;
      }
      // Points before the first image was there have no colour yet.
      EXPECT_GT(coloured, with.points.size() * 8 / 10);
      EXPECT_GT(later, with.points.size() / 10);
      EXPECT_LT(with.longest_provisional_wait_s, 0.02);
    }
  }
}

TEST(Windows, NoPointWaitsLongerThanItIsAllowed) {
  for (const double max_wait : {0.3, 0.6, 1.0}) {
    TestDrive test;
    test.until = 6;
    test.config.max_wait = from_seconds(max_wait);
    const Outcome out = run(test);
    expect_every_return_accounted_for(out);
    EXPECT_GT(count_state(out, ColourState::Direct) + count_state(out, ColourState::Neighbour),
              out.points.size() * 8 / 10);
    // The images arrive 80 ms late, and nothing comes out between two images.
    EXPECT_LT(out.longest_wait_s, std::max(max_wait, kInterval / 2) + kInterval + 0.1) << max_wait;
    EXPECT_GT(out.longest_wait_s, 0.3) << max_wait;
  }
}

TEST(Windows, ALostImageLeavesItsWindowUncolouredAndKept) {
  for (const int bridged : {0, 1}) {
    for (const double configured : {0.0, kInterval}) {  // T measured, T given
      TestDrive test;
      test.lost = {3};
      test.config.choice = ExposureChoice::Nearest;
      test.config.neighbours = 0;
      test.config.lost_image_neighbours = bridged;
      test.config.exposure_interval = from_seconds(configured);
      test.config.window_slack = nanoseconds(0);
      const Outcome out = run(test);
      expect_every_return_accounted_for(out);
      ASSERT_EQ(out.points.size(), out.truth_base.size());
      std::size_t inside = 0, from_nearer = 0;
      for (const ColouredPoint& p : out.points) {
        const double t = to_seconds(p.time - at(0));
        const bool is_lost = t >= exposure_time(3) - kInterval / 2 && t < exposure_time(3) + kInterval / 2;
        inside += is_lost;
        if (!is_lost) {
          EXPECT_NE(p.state, ColourState::NoExposure) << t;
        } else if (bridged == 0) {
          EXPECT_EQ(p.state, ColourState::NoExposure) << t;
          EXPECT_EQ(p.exposure, kNoExposure);
          EXPECT_EQ(p.quality, 0);
        } else if (p.state == ColourState::Neighbour) {
          // The nearer exposure, or the other one where the nearer does not see the point.
          EXPECT_TRUE(p.exposure == 2 || p.exposure == 4);
          from_nearer += p.exposure == (t < exposure_time(3) ? 2u : 4u);
        }
      }
      EXPECT_GT(inside, 1000u);
      if (bridged == 1) {
        EXPECT_GT(from_nearer, inside * 8 / 10);
      }
    }
  }
}

TEST(Windows, ExposuresThatCannotBeTrustedAreNeverUsed) {
  const std::vector<std::pair<std::function<void(Exposure&)>, std::uint64_t ColouringCounts::*>> faults{
      {[](Exposure& e) { e.timing = ExposureTiming::Unmatched; }, &ColouringCounts::exposures_unmatched},
      {[](Exposure& e) { e.image.is_complete = false; }, &ColouringCounts::exposures_incomplete},
      {[](Exposure& e) { e.image.height -= 1; }, &ColouringCounts::exposures_wrong_size},
      {[](Exposure& e) { e.camera = 77; }, &ColouringCounts::exposures_unknown_camera}};
  for (const auto& [spoil, counter] : faults) {
    TestDrive test;
    test.until = 1.5;
    test.config.choice = ExposureChoice::Nearest;
    test.alter = [&, &spoil = spoil](Exposure& e) {
      if (e.index == 2 || e.index == 3) spoil(e);
    };
    const Outcome out = run(test);
    expect_every_return_accounted_for(out);
    EXPECT_EQ(out.counts.*counter, 2u);
    for (const ColouredPoint& p : out.points) EXPECT_TRUE(p.exposure != 2 && p.exposure != 3);
    EXPECT_GT(count_state(out, ColourState::NoExposure), 0u);
  }
}

TEST(LostLens, CostsItsOwnPixelsAlone) {
  TestDrive test;
  const LensMount& lost = test.rig.head.lenses[1];
  test.alter = [&](Exposure& e) {
    if (e.index == 3) e.image.lost = {{lost.x_offset + 7, lost.y_offset + 9, 1, 1}};
  };
  const Outcome out = run(test), whole = run(TestDrive{});
  expect_every_return_accounted_for(out);
  EXPECT_EQ(out.counts.lenses_lost, 1u);
  EXPECT_EQ(out.counts.exposures_used, whole.counts.exposures_used);
  ASSERT_EQ(out.points.size(), whole.points.size());
  std::size_t concerned = 0, by_another = 0, others = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint &p = out.points[i], &w = whole.points[i];
    if (w.exposure == 3 && w.lens == 1) {
      ++concerned;
      EXPECT_FALSE(p.exposure == 3 && p.lens == 1);
      by_another += p.state == ColourState::Direct || p.state == ColourState::Neighbour;
    } else if (w.state == ColourState::Direct && !whole.judged.contains(i)) {
      // The exposure of one that was judged is chosen by all images, the lost one too.
      ++others;
      EXPECT_TRUE(p.exposure == w.exposure && p.lens == w.lens && p.red == w.red && p.green == w.green &&
                  p.blue == w.blue);
    }
  }
  EXPECT_GT(concerned, 100u);
  EXPECT_GT(by_another, concerned / 2);
  EXPECT_GT(others, 1000u);
}

TEST(Lateness, LateBatchesAndExposuresAreCountedNotFused) {
  TestDrive test;
  Colouring colouring(test.config, test.rig, [](const CloudBlock&) {});
  const auto batches = scan(test.drive, test.rig.lasers[0], 0.2, 0.3, 100, 32);
  for (int i = 0; i < 400; ++i) colouring.add(test.drive.solution(i / 200.0));
  colouring.advance(at(1.9));
  colouring.add(batches[0]);  // 1.7 s old, max_lateness is 1 s
  colouring.add(make_exposure(0, 0.1, ramp_image(0)));
  StampedLaserBatch foreign = batches[1];
  foreign.sensor = 99;
  colouring.add(foreign);
  colouring.flush();
  EXPECT_EQ(colouring.counts().late_batches, 1u);
  EXPECT_EQ(colouring.counts().late_returns, 32u);
  EXPECT_EQ(colouring.counts().exposures_late, 1u);
  EXPECT_EQ(colouring.counts().unknown_laser_returns, 32u);
  EXPECT_EQ(colouring.counts().points, 0u);
  const auto faults = colouring.take_faults();
  ASSERT_EQ(faults.size(), 3u);
  EXPECT_EQ(faults[0].kind, FaultKind::Late);
  EXPECT_EQ(faults[0].sensor, kCamera);
  EXPECT_EQ(faults[1].kind, FaultKind::Late);
  EXPECT_EQ(faults[1].sensor, kLaser);
  EXPECT_EQ(faults[2].kind, FaultKind::Spurious);
  EXPECT_TRUE(colouring.take_faults().empty());
}

TEST(Lateness, ADeadCameraOrPosCannotStallTheStream) {
  TestDrive no_camera;
  for (int i = 0; i < 100; ++i) no_camera.lost.push_back(i);
  no_camera.until = 8;
  no_camera.packet_rate = 20;
  std::uint64_t most_pending = 0;
  const auto batches = scan(no_camera.drive, no_camera.rig.lasers[0], 0.2, 20, 20, 16);
  std::uint64_t points = 0;
  Colouring colouring(no_camera.config, no_camera.rig, [&](const CloudBlock& b) { points += b.points.size(); });
  for (std::size_t i = 0; i < batches.size(); ++i) {
    const double t = 0.2 + static_cast<double>(i) / 20;
    for (int k = 0; k < 10; ++k) colouring.add(no_camera.drive.solution(t + k / 200.0));
    colouring.add(batches[i]);
    colouring.advance(at(t));
    most_pending = std::max(most_pending, colouring.counts().pending_returns);
  }
  EXPECT_LT(most_pending, 20u * 16 * 8);  // (neighbours + 1/2) s at the start interval and max_lateness
  EXPECT_GT(points, 20u * 16 * 12);
  EXPECT_EQ(colouring.counts().by_state[static_cast<std::size_t>(ColourState::NoExposure)], points);

  TestDrive no_pos;
  no_pos.until = 8;
  no_pos.packet_rate = 20;
  no_pos.has_solution = [](double t) { return t < 1.0 || (t > 2.0 && t < 3.0); };
  const Outcome out = run(no_pos);
  expect_every_return_accounted_for(out);
  EXPECT_NEAR(static_cast<double>(out.counts.no_pose[static_cast<std::size_t>(NoPose::Gap)]), 20 * 64, 2 * 64);
  EXPECT_NEAR(static_cast<double>(out.counts.no_pose[static_cast<std::size_t>(NoPose::AfterLast)]), 5 * 20 * 64,
              2 * 64);
  EXPECT_GT(out.counts.moments_without_pose, 3u);
}

TEST(Bounds, PendingReturnsAndImagesAreLimited) {
  TestDrive test;
  test.config.max_pending_returns = 1000;
  test.config.max_held_moments = 10;
  const Outcome out = run(test);
  expect_every_return_accounted_for(out);
  EXPECT_GT(out.counts.forced_batches, 0u);

  Colouring colouring(test.config, test.rig, [](const CloudBlock&) {});
  for (int i = 0; i < 40; ++i) colouring.add(test.drive.solution(i / 200.0));
  for (int i = 0; i < 14; ++i)
    colouring.add(make_exposure(static_cast<std::uint32_t>(i), 0.1 + 0.01 * i, flat_image(1, 1, 1)));
  colouring.advance(at(0.2));
  EXPECT_EQ(colouring.counts().moments_crowded_out, 4u);
}

TEST(ManyCameras, OneImageALensMakesOneMoment) {
  TestDrive test;
  test.rig.head.lenses.resize(2);
  test.rig.head.lenses[1].camera = 11;
  test.rig.head.lenses[1].y_offset = 0;
  std::vector<ColouredPoint> points;
  Colouring colouring(test.config, test.rig,
                      [&](const CloudBlock& b) { points.insert(points.end(), b.points.begin(), b.points.end()); });
  for (int i = 0; i < 400; ++i) colouring.add(test.drive.solution(i / 200.0));
  for (auto& batch : scan(test.drive, test.rig.lasers[0], 0.7, 0.8, 100, 64)) colouring.add(batch);
  for (int i = 0; i < 6; ++i) {
    for (int camera = 0; camera < 2; ++camera) {
      if (i == 2 && camera == 1) continue;  // one camera's image of one moment is lost
      Exposure e = make_exposure(static_cast<std::uint32_t>(2 * i + camera), exposure_time(i) + 1e-4 * camera,
                                 flat_image(50 * camera + 50, 9 * i, 0));
      e.camera = static_cast<SensorId>(kCamera + camera);
      colouring.add(e);
    }
  }
  colouring.flush();
  int by_lens[2] = {0, 0};
  for (const ColouredPoint& p : points) {
    if (p.exposure == kNoExposure) continue;
    ++by_lens[p.lens];
    EXPECT_EQ(p.red, 50 * p.lens + 50);
    EXPECT_EQ(p.exposure % 2, p.lens);
    EXPECT_NE(p.exposure, 5u);
  }
  EXPECT_GT(by_lens[0], 50);
  EXPECT_GT(by_lens[1], 50);
}

}  // namespace
}  // namespace hueline::fusion
