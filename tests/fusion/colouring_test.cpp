#include "fusion/colouring.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "fusion/pixel_mask.hpp"
#include "tests/fusion/test_drive.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;
using std::numbers::pi;

/// Returns where the image of a lens is sampled: at its border in the middle of a pixel.
Eigen::Vector2d sampled_at(const Eigen::Vector2d& pixel) {
  const double border = std::min({pixel.x(), pixel.y(), 305 - pixel.x(), 255 - pixel.y()});
  return border < kSampleReach ? Eigen::Vector2d(pixel.array().round()) : pixel;
}

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
      const Eigen::Vector2d at = sampled_at({p.u, p.v});
      worst_colour = std::max({worst_colour, std::abs(p.red - 0.8 * at.x()), std::abs(p.green - 0.9 * at.y()),
                               std::abs(p.blue - 10.0 * p.exposure)});
    }
  }
  EXPECT_GT(coloured, out.points.size() * 7 / 10);
  EXPECT_LT(worst_place, 1e-4);
  EXPECT_LT(worst_pixel, 0.01);
  EXPECT_LT(worst_colour, 1.1);  // two roundings to whole numbers
  RecordProperty("worst_place_m", std::to_string(worst_place));
  RecordProperty("worst_pixel", std::to_string(worst_pixel));
  std::printf("worst place %.2e m, worst pixel %.2e px, coloured %zu of %zu\n", worst_place, worst_pixel, coloured,
              out.points.size());
}

TEST(TwoScanners, EachGivesItsPointsByItsOwnMounting) {
  TestDrive test;
  LaserMount second = test.rig.lasers[0];
  second.sensor = kLaser + 1;
  second.T_body_scanner.translation += Eigen::Vector3d(-0.8, 0.3, 0.1);
  second.T_body_scanner.rotation =
      Eigen::AngleAxisd(-pi / 2, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(pi / 4, Eigen::Vector3d::UnitZ());
  test.rig.lasers.push_back(second);
  const Outcome out = run(test);
  ASSERT_EQ(out.points.size(), out.truth_base.size());
  std::map<SensorId, std::size_t> points, coloured;
  double worst = 0;
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const ColouredPoint& p = out.points[i];
    ++points[p.sensor];
    coloured[p.sensor] += p.state == ColourState::Direct || p.state == ColourState::Neighbour;
    worst =
        std::max(worst, (test.drive.point_in(out.origin, out.truth_base[i]) - Vector3(p.east, p.north, p.up)).norm());
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
    // Step 4: theta = acos(z / |p|) = y_p / r, azimuth = x_p / r with r = width / 2 pi; forward in the middle,
    // clockwise.
    const double r = 8000 / (2 * pi);
    double u = 3999.5 + r * std::atan2(-s.y(), s.x());
    if (u < -0.5) u += 8000;
    const double v = r * std::acos(s.z() / s.norm()) - 0.5;
    worst_pixel = std::max({worst_pixel, std::abs(std::remainder(u - p.u, 8000.0)), std::abs(v - p.v)});
    Eigen::Vector2d raw;
    ASSERT_TRUE(true_pixel(test, out.truth_base[i], static_cast<int>(p.exposure), p.lens, raw, 20.0));
    const Eigen::Vector2d at = sampled_at(raw);
    worst_colour = std::max({worst_colour, std::abs(p.red - 0.8 * at.x()), std::abs(p.green - 0.9 * at.y())});
  }
  EXPECT_LT(worst_pixel, 0.01);
  EXPECT_LT(worst_colour, 1.1);
  std::printf("worst panorama pixel %.2e px\n", worst_pixel);
}

TEST(Hole, IsFilledFromTheNearestExposureThatSeesThePoint) {
  TestDrive test;
  test.config.choice = ExposureChoice::Nearest;
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
    // No exposure that is nearer in time sees the point in the middle of a lens.
    for (int nearer = 0; nearer < 10; ++nearer) {
      if (std::abs(exposure_time(nearer) - t) >= std::abs(exposure_time(from) - t) - 1e-6 || is_in_hole(i, nearer))
        continue;
      for (int lens = 0; lens < 5; ++lens)
        EXPECT_FALSE(true_pixel(test, out.truth_base[i], nearer, lens, pixel)) << nearer;
    }
  }
  EXPECT_GT(in_hole, 40u);
  EXPECT_EQ(filled, in_hole);
}

class Mask : public testing::TestWithParam<std::tuple<ColourMethod, PixelFormat>> {};
std::string name_of(const testing::TestParamInfo<Mask::ParamType>& test) {
  const std::string method = std::get<0>(test.param) == ColourMethod::Lens ? "Lens" : "Panorama";
  return method + name(std::get<1>(test.param));
}
INSTANTIATE_TEST_SUITE_P(Each, Mask,
                         testing::Combine(testing::Values(ColourMethod::Lens, ColourMethod::Panorama),
                                          testing::Values(PixelFormat::BayerRG8, PixelFormat::BayerGB8,
                                                          PixelFormat::Rgb8, PixelFormat::Mono8)),
                         name_of);

TEST_P(Mask, PartsOfTheVehicleNeverGiveAColour) {
  const auto [method, format] = GetParam();
  TestDrive test;
  test.config.method = method;
  test.packet_rate = 300;
  const Polygon slanting_boom{{60, -1}, {75, -1}, {130, 190}, {118, 190}},
      speck{{220, 120}, {222, 120}, {222, 122}, {220, 122}}, bonnet{{-1, 180}, {400, 180}, {400, 300}, {-1, 300}},
      // Where the image of the lens before ends, which has no bonnet.
      top{{-1, -1}, {400, -1}, {400, 6}, {-1, 6}};
  const std::array<std::vector<Polygon>, 2> vehicle{{{slanting_boom, speck, bonnet, top}, {slanting_boom, speck}}};
  for (std::size_t i = 0; i < test.rig.head.lenses.size(); ++i) {
    test.rig.head.lenses[i].masks = vehicle[i % 2];
    test.rig.head.lenses[i].intrinsics.focal_px = {140, 140};  // what is below is at the images' borders
  }
  // The paper's rectangle at the bottom of the panorama.
  test.rig.head.panorama_masks = {{{3000, 2600}, {5000, 2600}, {5000, 4001}, {3000, 4001}}};
  const std::array<PixelMask, 2> masked{PixelMask(vehicle[0], 306, 256, 0), PixelMask(vehicle[1], 306, 256, 0)};
  test.image = [&, format = format](int) {
    return make_image(306, 6 * 256, format, [&](std::uint32_t x, std::uint32_t y, int c) {
      return masked[y / 256 % 2].covers(x, y % 256) ? (c == 1 ? 0.0 : 255.0) : 60.0 + 40 * c;
    });
  };
  const Outcome out = run(test);
  expect_every_return_accounted_for(out);
  EXPECT_GT(count_state(out, ColourState::Neighbour), 500u);
  const bool is_grey = format == PixelFormat::Mono8;
  std::size_t coloured = 0, beside_bonnet = 0, at_border = 0;
  for (const ColouredPoint& p : out.points) {
    if (p.exposure == kNoExposure) continue;
    ++coloured;
    ASSERT_EQ(p.red, is_grey ? 100 : 60) << p.u << ' ' << p.v;
    ASSERT_EQ(p.green, 100) << p.u << ' ' << p.v;
    ASSERT_EQ(p.blue, is_grey ? 100 : 140) << p.u << ' ' << p.v;
    if (method == ColourMethod::Panorama) {
      EXPECT_FALSE(p.u > 3000 && p.u < 5000 && p.v > 2601) << p.u << ' ' << p.v;
      continue;
    }
    if (p.lens % 2 == 0) {
      EXPECT_LT(p.v, 178.5f);
    }
    beside_bonnet += p.lens % 2 == 0 && p.v > 177.5f;
    at_border += p.v > 255.0f - kSampleReach;
  }
  EXPECT_GT(coloured, out.points.size() / 3);
  if (method == ColourMethod::Panorama) return;
  EXPECT_GT(beside_bonnet, 10u);
  EXPECT_GT(at_border, 5u);
}

TEST(Radiometry, ImagesOfDifferentGainGiveOneColour) {
  TestDrive test;
  test.rig.head.nadir_half_angle = 0.9;
  // Every second exposure has twice the light: 2 x 0.1274, 0.1878 and 0.0802, sRGB-coded.
  test.image = [](int i) { return i % 2 == 0 ? flat_image(100, 120, 80) : flat_image(137.9, 164.1, 111.5); };
  const Outcome plain = run(test);
  test.config.radiometry.rendering = Rendering::Consistent;
  const Outcome consistent = run(test);
  ASSERT_EQ(consistent.points.size(), plain.points.size());
  int worst_consistent = 0, worst_plain = 0;
  std::array<std::size_t, 2> of_state{};
  for (std::size_t i = 0; i < plain.points.size(); ++i) {
    const ColouredPoint &a = consistent.points[i], &b = plain.points[i];
    if (a.exposure == kNoExposure) continue;
    ++of_state.at(static_cast<std::size_t>(a.state));
    worst_consistent =
        std::max({worst_consistent, std::abs(a.red - 100), std::abs(a.green - 120), std::abs(a.blue - 80)});
    worst_plain = std::max({worst_plain, std::abs(b.red - 100), std::abs(b.green - 120), std::abs(b.blue - 80)});
  }
  EXPECT_GT(of_state[0], 1000u);
  EXPECT_GT(of_state[1], 100u);
  EXPECT_LE(worst_consistent, 1);
  EXPECT_EQ(worst_plain, 44);
  EXPECT_GT(consistent.counts.gain_pairs, 0u);
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
  for (const int threads : {2, 4}) {
    test.config.threads = threads;
    const Outcome many = run(test);
    ASSERT_EQ(many.points.size(), one.points.size());
    for (std::size_t i = 0; i < one.points.size(); ++i) ASSERT_TRUE(one.points[i] == many.points[i]) << i;
  }
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
  EXPECT_THAT(config.validate(), testing::HasSubstr("max_pose_gap_s"));
  RigGeometry rig = ladybug_rig(LensModel::Brown);
  EXPECT_EQ(rig.validate(), "");
  rig.head.lenses[2].T_head_lens.rotation.coeffs() *= 1.1;
  EXPECT_THAT(rig.validate(), testing::HasSubstr("lenses[2]"));
  rig = ladybug_rig(LensModel::Brown);
  rig.head.panorama.stitching_radius_m = 0;
  EXPECT_THAT(rig.validate(), testing::HasSubstr("stitching_radius_m"));
  rig = ladybug_rig(LensModel::Brown);
  rig.lasers.push_back(rig.lasers[0]);
  EXPECT_THAT(rig.validate(), testing::HasSubstr("twice"));
}

}  // namespace
}  // namespace hueline::fusion
