#include "survey/vehicle_masks.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/survey/standing_vehicle.hpp"

namespace hueline::survey {
namespace {

using namespace hueline::test;

std::vector<std::size_t> those(const std::vector<bool>& of) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < of.size(); ++i)
    if (of[i]) out.push_back(i);
  return out;
}

TEST(VehicleMasks, AfterTheFirstPassLensesAheadAndBackJudgeEachOther) {
  const StandingVehicle vehicle;
  const auto passes = mask_passes(vehicle.rig);
  ASSERT_EQ(passes.size(), 3u);
  EXPECT_EQ(those(passes[0].gives_colour).size(), vehicle.rig.head.lenses.size());
  EXPECT_EQ(those(passes[0].is_judged).size(), vehicle.rig.head.lenses.size());
  for (const std::size_t ahead : {0u, 1u, 4u}) EXPECT_TRUE(passes[1].gives_colour[ahead]) << ahead;
  for (const std::size_t back : {2u, 3u}) EXPECT_TRUE(passes[2].gives_colour[back]) << back;
  EXPECT_EQ(passes[1].gives_colour, passes[2].is_judged);
  EXPECT_EQ(passes[2].gives_colour, passes[1].is_judged);
  for (std::size_t i = 0; i < vehicle.rig.head.lenses.size(); ++i)
    EXPECT_NE(passes[1].is_judged[i], passes[2].is_judged[i]) << i;
}

TEST(VehicleMasks, AHeadThatLooksToOneSideHasPassesWithAllLenses) {
  StandingVehicle vehicle;
  vehicle.rig.head.lenses.resize(1);
  const auto passes = mask_passes(vehicle.rig);
  ASSERT_EQ(passes.size(), 2u);
  for (const MaskPass& pass : passes) {
    EXPECT_TRUE(pass.gives_colour[0]);
    EXPECT_TRUE(pass.is_judged[0]);
  }
}

TEST(VehicleMasks, ARigOfAPassHasTheMasksThatWereFoundAndNoOthers) {
  StandingVehicle vehicle;
  auto& lenses = vehicle.rig.head.lenses;
  lenses[0].masks = lenses[1].masks = {{{1, 1}, {9, 1}, {9, 9}}};
  vehicle.rig.head.nadir_half_angle = 0.5;
  const auto passes = mask_passes(vehicle.rig);
  std::vector<calibration::VehicleMask::Found> found(lenses.size());
  const fusion::RigGeometry first = rig_of_pass(vehicle.rig, passes[0], found);
  EXPECT_EQ(first.head.nadir_half_angle, 0);
  for (const fusion::LensMount& lens : first.head.lenses) EXPECT_TRUE(lens.masks.empty());

  found[0].polygons = {{{2, 2}, {8, 2}, {8, 8}}};
  const fusion::RigGeometry ahead = rig_of_pass(vehicle.rig, passes[1], found);
  EXPECT_EQ(ahead.head.lenses[0].masks, found[0].polygons);
  EXPECT_TRUE(ahead.head.lenses[1].masks.empty());
  // Lens 2 looks back, and gives no colour anywhere.
  const auto width = lenses[2].intrinsics.width, height = lenses[2].intrinsics.height;
  const fusion::PixelMask all(ahead.head.lenses[2].masks, width, height, 0);
  for (const std::uint32_t x : {0u, width / 2, width - 1})
    for (const std::uint32_t y : {0u, height / 2, height - 1}) EXPECT_TRUE(all.covers(x, y)) << x << " " << y;
}

TEST(VehicleMasks, AVehicleThatStandsTeachesNothing) {
  const StandingVehicle vehicle;
  const Image image = vehicle.image([](double azimuth, double, int) { return 100 + azimuth / 2; });
  std::vector<StampedLaserBatch> batches;
  std::vector<Exposure> exposures;
  for (int i = 0; i < 40; ++i) {
    StampedLaserBatch batch;
    batch.sensor = kLaser;
    batch.packet_sequence = static_cast<std::uint64_t>(i);
    batch.time = at(0.1 * i);
    for (int column = -50; column <= 50; ++column)
      for (int row = -20; row <= 20; ++row) batch.returns.push_back(vehicle.seen_at(column, row, 8, 0, 0));
    batches.push_back(std::move(batch));
    if (i % 2 == 0) exposures.push_back(make_exposure(static_cast<std::uint32_t>(i), 0.1 * i + 0.05, image));
  }
  VehicleMasks masks({}, vehicle.rig, 1);
  vehicle.feed(masks, batches, exposures, 4);
  const auto found = masks.finish();
  ASSERT_EQ(found.size(), vehicle.rig.head.lenses.size());
  EXPECT_EQ(found[0].views, 1);
  EXPECT_GT(found[0].compared, 100u);
  for (const auto& lens : found) EXPECT_FALSE(lens.is_determined);
}

}  // namespace
}  // namespace hueline::survey
