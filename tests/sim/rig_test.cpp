#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "sim/own_vehicle.hpp"
#include "sim/rig_truth.hpp"
#include "sim/scenario.hpp"
#include "sim/texture.hpp"
#include "sim/tone.hpp"

namespace hueline::sim {
namespace {

TEST(OwnVehicle, IsInViewOfTheLensesThatLookDownOnIt) {
  Scenario scenario;
  scenario.camera.lens_width = 152;
  scenario.camera.lens_height = 128;
  const RigTruth rig = rig_truth(scenario);
  for (std::size_t lens = 0; lens < 6; ++lens) {
    const auto mask = rig.own_vehicle_mask(lens);
    const auto seen = static_cast<std::size_t>(std::count(mask.begin(), mask.end(), 255));
    if (lens == 5) {
      EXPECT_EQ(seen, 0u) << "the lens that looks up";
      continue;
    }
    EXPECT_GT(seen, mask.size() / 50) << "the roof is in view of lens " << lens;
    // The image's x axis points down, so the vehicle is in the last columns and the sky in the first.
    for (std::size_t row = 0; row < 128; ++row)
      for (std::size_t column = 0; column < 40; ++column) EXPECT_EQ(mask[152 * row + column], 0) << "lens " << lens;
  }
}

TEST(OwnVehicle, ByHand) {
  // A ray from above straight down onto the roof of the cabin at 0.85 m.
  const auto roof = own_vehicle_on_ray({0.7, -1.9, 3}, {0, 0, -1});
  ASSERT_TRUE(roof);
  EXPECT_NEAR(roof->distance_m, 2.15, 1e-12);
  EXPECT_EQ(roof->normal_body.z, 1);
  // A ray from the right at the height of the doors.
  const auto door = own_vehicle_on_ray({5, 0, 0}, {-1, 0, 0});
  ASSERT_TRUE(door);
  EXPECT_NEAR(door->distance_m, 4.1, 1e-12);
  EXPECT_FALSE(own_vehicle_on_ray({5, 0, 0}, {1, 0, 0}));
  EXPECT_FALSE(own_vehicle_on_ray({5, 0, 2.2}, {-1, 0, 0}));
}

TEST(Lasers, TablesOfTheManuals) {
  const LaserTiming vlp = laser_timing(LaserModel::Vlp16, true);
  ASSERT_EQ(vlp.beams.size(), 16u);
  EXPECT_NEAR(degrees(vlp.beams[0].elevation), -15, 1e-12);
  EXPECT_NEAR(degrees(vlp.beams[1].elevation), 1, 1e-12);
  EXPECT_EQ(vlp.beams[1].channel, 8);
  EXPECT_NEAR(vlp.beams[15].vertical_offset_m, -0.0112, 1e-12);
  EXPECT_EQ(vlp.packet_period_ns(), 1'327'104);
  // 0.40 deg a block is 602.816 rpm.
  EXPECT_NEAR(vlp.block_step_centideg / 36000.0 / (static_cast<double>(vlp.block_period_ns()) * 1e-9) * 60, 602.816,
              1e-3);
  const LaserTiming hdl = laser_timing(LaserModel::Hdl32e, true);
  ASSERT_EQ(hdl.beams.size(), 32u);
  for (const auto& [laser, elevation, channel] : std::vector<std::tuple<std::size_t, double, int>>{{0, -30.67, 0},
                                                                                                   {1, -9.33, 16},
                                                                                                   {2, -29.33, 1},
                                                                                                   {3, -8.00, 17},
                                                                                                   {15, 0.0, 23},
                                                                                                   {30, -10.67, 15},
                                                                                                   {31, 10.67, 31}}) {
    EXPECT_NEAR(degrees(hdl.beams[laser].elevation), elevation, 1e-9) << laser;
    EXPECT_EQ(hdl.beams[laser].channel, channel);
  }
  EXPECT_EQ(hdl.packet_period_ns(), 552'960);
}

TEST(Texture, FiltersKeepTheMean) {
  // A long footprint sees the duty cycle of the pattern; a short one sees either part.
  EXPECT_NEAR(covered_periodic(3.21f, 40.0f, 1.0f, 0.2f, 0.5f), 0.3f, 1e-3f);
  EXPECT_NEAR(covered_periodic(7.35f, 0.01f, 1.0f, 0.2f, 0.5f), 1.0f, 1e-4f);
  EXPECT_NEAR(covered_periodic(-6.35f, 0.01f, 1.0f, 0.2f, 0.5f), 0.0f, 1e-4f);
  EXPECT_NEAR(covered(0.0f, 2.0f, 0.0f, 5.0f), 0.5f, 1e-6f);
  // The average of many fine samples equals one wide sample.
  double fine = 0;
  for (int i = 0; i < 1000; ++i)
    fine += covered_periodic(-0.6f + 1.7f * (static_cast<float>(i) + 0.5f) / 1000.0f, 1e-3f, 0.7f, 0.1f, 0.25f);
  EXPECT_NEAR(fine / 1000, covered_periodic(0.25f, 1.7f, 0.7f, 0.1f, 0.25f), 2e-3);
  EXPECT_EQ(smooth_noise(3.3f, 4.4f, 2.0f, 5), 0.0f);
  double sum = 0;
  for (int i = 0; i < 10000; ++i)
    sum += smooth_noise(static_cast<float>(i) * 0.37f, static_cast<float>(i) * 0.11f, 0.0f, 5);
  EXPECT_NEAR(sum / 10000, 0, 0.05);
}

TEST(Tone, StandardCurve) {
  const Tone srgb(ToneCurve::Srgb, 1), linear(ToneCurve::Linear, 1);
  EXPECT_EQ(srgb(0.0f), 0);
  EXPECT_EQ(srgb(1.0f), 255);
  EXPECT_EQ(srgb(0.214f), 127);  // IEC 61966-2-1: 0.2140 -> 0.5000
  EXPECT_EQ(linear(0.5f), 128);
  EXPECT_EQ(linear(7.0f), 255);
  EXPECT_EQ(linear(-0.1f), 0);
}

}  // namespace
}  // namespace hueline::sim
