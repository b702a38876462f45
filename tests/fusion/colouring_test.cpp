#include "fusion/colouring.hpp"

#include <gmock/gmock.h>

#include <cstring>
#include <map>
#include <numbers>
#include <numeric>

#include "test_drive.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;
using std::numbers::pi;

class BothModels : public testing::TestWithParam<LensModel> {};
INSTANTIATE_TEST_SUITE_P(Lens, BothModels, testing::Values(LensModel::Brown, LensModel::KannalaBrandt),
                         [](const auto& test) { return test.param == LensModel::Brown ? "Brown" : "KannalaBrandt"; });

TEST_P(BothModels, PlacesAndProjectsWhereTheTruthIs) {
  TestDrive test;
  test.rig = ladybug_rig(GetParam());
  const Outcome out = run(test);
  ASSERT_EQ(out.points.size(), out.truth_base.size());
  double worst_place = 0, worst_pixel = 0, worst_colour = 0;
  std::size_t coloured = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint& p = out.points[i];
    const Vector3 truth = test.drive.point_in(out.origin, out.truth_base[i]);
    worst_place = std::max(worst_place, (truth - Vector3(p.east, p.north, p.up)).norm());
    if (p.state != ColourState::Direct && p.state != ColourState::Neighbour) continue;
    ++coloured;
    Eigen::Vector2d pixel;
    ASSERT_TRUE(true_pixel(test, out.truth_base[i], static_cast<int>(p.exposure), p.lens, pixel)) << i;
    worst_pixel = std::max(worst_pixel, (pixel - Eigen::Vector2d(p.u, p.v)).norm());
    if (p.state == ColourState::Direct) {
      worst_colour = std::max({worst_colour, std::abs(p.red - 0.8 * p.u), std::abs(p.green - 0.9 * p.v),
                               std::abs(p.blue - 10.0 * p.exposure)});
    }
  }
  EXPECT_GT(coloured, out.points.size() * 7 / 10);
  EXPECT_LT(worst_place, 1e-4);
  EXPECT_LT(worst_pixel, 0.01);
  EXPECT_LT(worst_colour, 1.1);  // two roundings to whole numbers
  RecordProperty("worst_place_m", std::to_string(worst_place));
  RecordProperty("worst_pixel", std::to_string(worst_pixel));
  std::printf("worst place %.2e m, worst pixel %.2e px, coloured %zu of %zu\n", worst_place, worst_pixel, coloured, out.points.size());
}

TEST(TwoScanners, EachGivesItsPointsByItsOwnMounting) {
  TestDrive test;
  LaserMount second = test.rig.lasers[0];
  second.sensor = kLaser + 1;
  second.T_body_scanner.translation += Eigen::Vector3d(-0.8, 0.3, 0.1);
  second.T_body_scanner.rotation = Eigen::AngleAxisd(-pi / 2, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(pi / 4, Eigen::Vector3d::UnitZ());
  test.rig.lasers.push_back(second);
  const Outcome out = run(test);
  ASSERT_EQ(out.points.size(), out.truth_base.size());
  std::map<SensorId, std::size_t> points, coloured;
  double worst = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint& p = out.points[i];
    ++points[p.sensor];
    coloured[p.sensor] += p.state == ColourState::Direct || p.state == ColourState::Neighbour;
    worst = std::max(worst, (test.drive.point_in(out.origin, out.truth_base[i]) - Vector3(p.east, p.north, p.up)).norm());
  }
  EXPECT_LT(worst, 1e-4);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[kLaser], points[kLaser + 1]);
  for (const auto& [sensor, count] : points) EXPECT_GT(coloured[sensor], count * 7 / 10) << sensor;
  EXPECT_EQ(out.counts.unknown_laser_returns, 0u);
}

TEST(SphereMethod, PanoramaPixelAndRawPixelFollowThePaper) {
  TestDrive test;
  test.config.method = ColourMethod::Panorama;
  const Outcome out = run(test);
  ASSERT_EQ(out.points.size(), out.truth_base.size());
  double worst_pixel = 0, worst_colour = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint& p = out.points[i];
    if (p.state != ColourState::Direct) continue;
    const Vector3 s = in_head_at(test, out.truth_base[i], exposure_time(static_cast<int>(p.exposure)));
    // Step 4: theta = acos(z / |p|) = y_p / r, azimuth = x_p / r with r = width / 2 pi; forward in the middle, clockwise.
    const double r = 8000 / (2 * pi);
    double u = 3999.5 + r * std::atan2(-s.y(), s.x());
    if (u < -0.5) u += 8000;
    const double v = r * std::acos(s.z() / s.norm()) - 0.5;
    worst_pixel = std::max({worst_pixel, std::abs(std::remainder(u - p.u, 8000.0)), std::abs(v - p.v)});
    Eigen::Vector2d raw;
    ASSERT_TRUE(true_pixel(test, out.truth_base[i], static_cast<int>(p.exposure), p.lens, raw, 20.0));
    worst_colour = std::max({worst_colour, std::abs(p.red - 0.8 * raw.x()), std::abs(p.green - 0.9 * raw.y())});
  }
  EXPECT_LT(worst_pixel, 0.01);
  EXPECT_LT(worst_colour, 1.1);
  std::printf("worst panorama pixel %.2e px\n", worst_pixel);
}


std::uint64_t count_state(const Outcome& out, ColourState state) { return out.counts.by_state[static_cast<std::size_t>(state)]; }

std::uint64_t sum(const std::array<std::uint64_t, kNoPoseReasons>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

void expect_every_return_accounted_for(const Outcome& out) {
  const ColouringCounts& c = out.counts;
  EXPECT_EQ(c.returns, c.points + sum(c.no_pose) + c.late_returns + c.empty_returns + c.unknown_laser_returns + c.pending_returns);
  EXPECT_EQ(c.points, out.points.size());
  EXPECT_EQ(c.points, std::accumulate(c.by_state.begin(), c.by_state.end(), std::uint64_t{0}));
  EXPECT_EQ(c.pending_returns, 0u);
  EXPECT_EQ(c.exposures, c.exposures_used + c.exposures_unmatched + c.exposures_incomplete + c.exposures_wrong_size + c.exposures_late +
                             c.exposures_unknown_camera);
}

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

TEST(Windows, ALostImageLeavesItsWindowUncolouredAndKept) {
  for (const int bridged : {0, 1}) {
    for (const double configured : {0.0, kInterval}) {  // T measured, T given
      TestDrive test;
      test.lost = {3};
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
          // The nearer one, or the other where the nearer does not see it.
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
    } else if (w.state == ColourState::Direct) {
      ++others;
      EXPECT_TRUE(p.exposure == w.exposure && p.lens == w.lens && p.red == w.red && p.green == w.green && p.blue == w.blue);
    }
  }
  EXPECT_GT(concerned, 100u);
  EXPECT_GT(by_another, concerned / 2);
  EXPECT_GT(others, 1000u);
}

TEST(Hole, IsFilledFromTheNearestExposureThatSeesThePoint) {
  TestDrive test;
  test.rig.head.nadir_half_angle = 0.9;
  const Outcome out = run(test);
  expect_every_return_accounted_for(out);
  ASSERT_EQ(out.points.size(), out.truth_base.size());
  std::size_t filled = 0, in_hole = 0;
  const auto is_in_hole = [&](std::size_t i, int exposure) {
    const Vector3 p = in_head_at(test, out.truth_base[i], exposure_time(exposure));
    return std::acos(-p.z() / p.norm()) < 0.9;
  };
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint& p = out.points[i];
    const double t = to_seconds(p.time - at(0));
    if (t < 0.8 || t > 1.2) continue;  // four exposures on each side
    const int owner = static_cast<int>(std::floor((t - kFirstExposure) / kInterval + 0.5));
    if (!is_in_hole(i, owner)) continue;
    ++in_hole;
    ASSERT_NE(p.state, ColourState::Direct);
    if (p.state != ColourState::Neighbour) continue;
    ++filled;
    const int from = static_cast<int>(p.exposure);
    EXPECT_FALSE(is_in_hole(i, from));
    Eigen::Vector2d pixel;
    ASSERT_TRUE(true_pixel(test, out.truth_base[i], from, p.lens, pixel));
    EXPECT_LT((pixel - Eigen::Vector2d(p.u, p.v)).norm(), 0.01);
    // No exposure nearer in time sees it in the middle of a lens.
    for (int nearer = 0; nearer < 10; ++nearer) {
      if (std::abs(exposure_time(nearer) - t) >= std::abs(exposure_time(from) - t) - 1e-6 || is_in_hole(i, nearer)) continue;
      for (int lens = 0; lens < 5; ++lens) EXPECT_FALSE(true_pixel(test, out.truth_base[i], nearer, lens, pixel)) << nearer;
    }
  }
  EXPECT_GT(in_hole, 40u);
  EXPECT_EQ(filled, in_hole);
}

TEST(Mask, PartsOfTheVehicleNeverGiveAColour) {
  for (const ColourMethod method : {ColourMethod::Lens, ColourMethod::Panorama}) {
    TestDrive test;
    test.config.method = method;
    for (LensMount& lens : test.rig.head.lenses) lens.masks = {{{-1, 180}, {400, 180}, {400, 300}, {-1, 300}}};
    // The paper's rectangle at the bottom of the panorama.
    test.rig.head.panorama_masks = {{{3000, 2600}, {5000, 2600}, {5000, 4001}, {3000, 4001}}};
    const Outcome out = run(test);
    expect_every_return_accounted_for(out);
    EXPECT_GT(count_state(out, ColourState::Neighbour), 500u);
    std::size_t coloured = 0;
    for (const ColouredPoint& p : out.points) {
      if (p.exposure == kNoExposure) continue;
      ++coloured;
      if (method == ColourMethod::Lens) {
        EXPECT_LT(p.v, 178.0f);
      } else {
        EXPECT_FALSE(p.u > 3000 && p.u < 5000 && p.v > 2601) << p.u << ' ' << p.v;
        if (p.state == ColourState::Direct) {  // not scaled by a gain: green tells the row that was sampled
          EXPECT_LT(p.green, 0.9 * 180);
        }
      }
    }
    EXPECT_GT(coloured, out.points.size() / 2);
  }
}

TEST(Balance, FilledPointsTakeTheBrightnessOfTheirOwner) {
  TestDrive test;
  test.rig.head.nadir_half_angle = 0.9;
  // Every second exposure is 40 % brighter, with a tint.
  test.image = [](int i) { return i % 2 == 0 ? flat_image(100, 120, 80) : flat_image(140, 160, 120); };
  const Outcome balanced = run(test);
  test.config.balance_neighbours = false;
  const Outcome plain = run(test);
  ASSERT_EQ(balanced.points.size(), plain.points.size());
  int worst_balanced = 0, worst_plain = 0;
  for (std::size_t i = 0; i < plain.points.size(); ++i) {
    const ColouredPoint &a = balanced.points[i], &b = plain.points[i];
    if (a.state != ColourState::Neighbour) continue;
    const double t = to_seconds(a.time - at(0));
    const int owner = static_cast<int>(std::floor((t - kFirstExposure) / kInterval + 0.5));
    const int red = owner % 2 == 0 ? 100 : 140, green = owner % 2 == 0 ? 120 : 160, blue = owner % 2 == 0 ? 80 : 120;
    worst_balanced = std::max({worst_balanced, std::abs(a.red - red), std::abs(a.green - green), std::abs(a.blue - blue)});
    worst_plain = std::max({worst_plain, std::abs(b.red - red), std::abs(b.green - green), std::abs(b.blue - blue)});
  }
  EXPECT_LE(worst_balanced, 1);
  EXPECT_EQ(worst_plain, 40);
  EXPECT_GT(balanced.counts.gain_pairs, 0u);
}

TEST(Lateness, LateBatchesAndExposuresAreCountedNotFused) {
  TestDrive test;
  Colouring colouring(test.config, test.rig, [](CloudBlock&&) {});
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
  Colouring colouring(no_camera.config, no_camera.rig, [&](CloudBlock&& b) { points += b.points.size(); });
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
  EXPECT_NEAR(static_cast<double>(out.counts.no_pose[static_cast<std::size_t>(NoPose::AfterLast)]), 5 * 20 * 64, 2 * 64);
  EXPECT_GT(out.counts.moments_without_pose, 3u);
}

TEST(Determinism, AnyNumberOfThreadsGivesTheSameBytes) {
  TestDrive test;
  test.rig.head.nadir_half_angle = 0.7;
  test.image = [](int i) {
    return make_image(306, 6 * 256, PixelFormat::BayerGB8, [i](std::uint32_t x, std::uint32_t y, int c) {
      return 60 + (7 * i) + 0.3 * x + 30 * std::sin(0.05 * y + c);
    });
  };
  const Outcome one = run(test);
  ASSERT_GT(one.points.size(), 10000u);
  const auto same = [](const ColouredPoint& a, const ColouredPoint& b) {
    return a.east == b.east && a.north == b.north && a.up == b.up && a.time == b.time && a.exposure == b.exposure && a.u == b.u &&
           a.v == b.v && a.red == b.red && a.green == b.green && a.blue == b.blue && a.state == b.state && a.lens == b.lens &&
           a.quality == b.quality && a.channel == b.channel && a.sensor == b.sensor && a.sigma_m == b.sigma_m &&
           a.reflectivity == b.reflectivity && a.return_number == b.return_number && a.return_count == b.return_count;
  };
  for (const int threads : {2, 4}) {
    test.config.threads = threads;
    const Outcome many = run(test);
    ASSERT_EQ(many.points.size(), one.points.size());
    for (std::size_t i = 0; i < one.points.size(); ++i) ASSERT_TRUE(same(one.points[i], many.points[i])) << i;
  }
}

TEST(Bounds, PendingReturnsAndImagesAreLimited) {
  TestDrive test;
  test.config.max_pending_returns = 1000;
  test.config.max_held_moments = 10;
  const Outcome out = run(test);
  expect_every_return_accounted_for(out);
  EXPECT_GT(out.counts.forced_batches, 0u);

  Colouring colouring(test.config, test.rig, [](CloudBlock&&) {});
  for (int i = 0; i < 40; ++i) colouring.add(test.drive.solution(i / 200.0));
  for (int i = 0; i < 14; ++i) colouring.add(make_exposure(static_cast<std::uint32_t>(i), 0.1 + 0.01 * i, flat_image(1, 1, 1)));
  colouring.advance(at(0.2));
  EXPECT_EQ(colouring.counts().moments_crowded_out, 4u);
}

TEST(ManyCameras, OneImageALensMakesOneMoment) {
  TestDrive test;
  test.rig.head.lenses.resize(2);
  test.rig.head.lenses[1].camera = 11;
  test.rig.head.lenses[1].y_offset = 0;
  std::vector<ColouredPoint> points;
  Colouring colouring(test.config, test.rig, [&](CloudBlock&& b) { points.insert(points.end(), b.points.begin(), b.points.end()); });
  for (int i = 0; i < 400; ++i) colouring.add(test.drive.solution(i / 200.0));
  for (auto& batch : scan(test.drive, test.rig.lasers[0], 0.7, 0.8, 100, 64)) colouring.add(batch);
  for (int i = 0; i < 6; ++i) {
    for (int camera = 0; camera < 2; ++camera) {
      if (i == 2 && camera == 1) continue;  // one camera's image of one moment is lost
      Exposure e = make_exposure(static_cast<std::uint32_t>(2 * i + camera), exposure_time(i) + 1e-4 * camera, flat_image(50 * camera + 50, 9 * i, 0));
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

TEST(Config, RefusesNonsenseByName) {
  Colouring::Config config;
  EXPECT_EQ(config.validate(), "");
  config.threads = 0;
  EXPECT_THAT(config.validate(), testing::HasSubstr("threads"));
  config = {};
  config.max_held_moments = 3;
  EXPECT_THAT(config.validate(), testing::HasSubstr("max_held_moments"));
  config = {};
  config.trajectory.max_gap = nanoseconds(0);
  EXPECT_THAT(config.validate(), testing::HasSubstr("max_gap"));
  RigGeometry rig = ladybug_rig(LensModel::Brown);
  EXPECT_EQ(rig.validate(), "");
  rig.head.lenses[2].T_head_lens.rotation.coeffs() *= 1.1;
  EXPECT_THAT(rig.validate(), testing::HasSubstr("lens 2"));
  rig = ladybug_rig(LensModel::Brown);
  rig.head.panorama.stitching_radius_m = 0;
  EXPECT_THAT(rig.validate(), testing::HasSubstr("stitching_radius_m"));
  rig = ladybug_rig(LensModel::Brown);
  rig.lasers.push_back(rig.lasers[0]);
  EXPECT_THAT(rig.validate(), testing::HasSubstr("twice"));
}

}  // namespace
}  // namespace hueline::fusion
