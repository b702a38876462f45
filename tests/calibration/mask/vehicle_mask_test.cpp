#include "calibration/mask/vehicle_mask.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "fusion/pixel_mask.hpp"

namespace hueline::calibration {
namespace {

constexpr int kWidth = 160, kHeight = 120;
using Colour = std::array<std::uint8_t, 3>;
using Shape = std::function<bool(int x, int y)>;

Colour grey(double value) {
  const auto byte = static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
  return {byte, byte, byte};
}

/// A made-up drive: a world of spots that passes, under light that changes from image to image.
struct Drive {
  Shape vehicle = [](int, int) { return false; };
  std::function<double(int x, int y)> paint = [](int x, int y) { return 90.0 + 10 * ((x / 6 + y / 4) % 3); };
  double road = 90, spots = 12;  // mean and standard deviation of the world's brightness
  double noise = 2;
  Shape is_predicted = [](int, int) { return true; };
};

VehicleMask::Found found(const Drive& drive, int views = 40) {
  VehicleMask mask(kWidth, kHeight);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int view = 0; view < views; ++view) {
    // Spots of 3 x 3 pixels, elsewhere in each view.
    std::vector<double> spot(static_cast<std::size_t>(kWidth * kHeight));
    for (double& s : spot) s = normal(random);
    const double light = 0.6 + 0.5 * std::abs(std::sin(view * 0.7));
    std::vector<PredictedPixel> pixels;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        if (!drive.is_predicted(x, y)) continue;
        const double world = drive.road + drive.spots * spot[static_cast<std::size_t>((y / 3) * kWidth + x / 3)];
        const double seen = light * (drive.vehicle(x, y) ? drive.paint(x, y) : world);
        pixels.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                          grey(light * world + drive.noise * normal(random)),
                          grey(seen + drive.noise * normal(random))});
      }
    mask.add(pixels);
  }
  return mask.find();
}

struct Errors {
  double missed, too_much;  // shares of the vehicle, and of the rest
};

/// As the colouring reads the polygons.
Errors errors(const VehicleMask::Found& found, const Shape& vehicle) {
  const fusion::PixelMask mask(found.polygons, kWidth, kHeight, 0);
  int of_vehicle = 0, missed = 0, too_much = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool is_masked = mask.covers(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
      of_vehicle += vehicle(x, y) ? 1 : 0;
      missed += vehicle(x, y) && !is_masked ? 1 : 0;
      too_much += !vehicle(x, y) && is_masked ? 1 : 0;
    }
  return {of_vehicle > 0 ? static_cast<double>(missed) / of_vehicle : 0,
          static_cast<double>(too_much) / (kWidth * kHeight - of_vehicle)};
}

bool is_bonnet(int x, int y) { return y > 80 + std::abs(x - 80) / 8; }

TEST(VehicleMask, WhatDoesNotFollowThePredictionsIsTheVehicle) {
  Drive drive;
  drive.vehicle = is_bonnet;
  const VehicleMask::Found bonnet = found(drive);
  EXPECT_TRUE(bonnet.is_determined);
  EXPECT_EQ(bonnet.views, 40);
  EXPECT_EQ(bonnet.polygons.size(), 1u);
  const Errors error = errors(bonnet, is_bonnet);
  EXPECT_LT(error.missed, 0.02);
  EXPECT_LT(error.too_much, 0.02);
}

TEST(VehicleMask, AVehicleOfTheRoadsColourIsToldByTheRoadsTexture) {
  Drive drive;
  drive.vehicle = is_bonnet;
  drive.paint = [&drive](int, int) { return drive.road; };
  const Errors error = errors(found(drive), is_bonnet);
  EXPECT_LT(error.missed, 0.02);
  EXPECT_LT(error.too_much, 0.02);
}

TEST(VehicleMask, ALensThatSeesNoVehicleHasNoMask) {
  const VehicleMask::Found nothing = found({});
  EXPECT_TRUE(nothing.is_determined);
  EXPECT_TRUE(nothing.polygons.empty());
  EXPECT_TRUE(std::ranges::none_of(nothing.vehicle, [](bool one) { return one; }));
}

TEST(VehicleMask, WithoutTextureAnotherColourIsTheVehicleAndTheSameIsNot) {
  Drive drive;
  drive.vehicle = is_bonnet;
  drive.spots = 0;
  drive.noise = 0.5;
  drive.paint = [](int, int) { return 200.0; };
  EXPECT_LT(errors(found(drive), is_bonnet).missed, 0.02);
  EXPECT_LT(errors(found(drive), is_bonnet).too_much, 0.02);
  drive.paint = [&drive](int, int) { return drive.road; };
  EXPECT_TRUE(found(drive).polygons.empty());
}

TEST(VehicleMask, WhatNoPointShowsIsNotTheVehicle) {
  Drive drive;
  drive.vehicle = is_bonnet;
  drive.is_predicted = [](int, int y) { return y > 60; };  // the sky
  const VehicleMask::Found below = found(drive);
  EXPECT_EQ(below.cells.front(), VehicleMask::Cell::Unknown);
  EXPECT_LT(errors(below, is_bonnet).missed, 0.02);
  EXPECT_LT(errors(below, is_bonnet).too_much, 0.02);
}

TEST(VehicleMask, TheWorldThatIsPredictedWronglyButMovesIsNotTheVehicle) {
  // Far trees: predictions of other leaves. They do not follow, and what is seen does not stay the same.
  VehicleMask mask(kWidth, kHeight);
  std::mt19937 random(5);
  std::uniform_int_distribution<int> leaf(20, 120);
  for (int view = 0; view < 40; ++view) {
    std::vector<PredictedPixel> pixels;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        pixels.push_back(
            {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), grey(leaf(random)), grey(leaf(random))});
    mask.add(pixels);
  }
  EXPECT_TRUE(mask.find().polygons.empty());
  EXPECT_FALSE(mask.find().is_determined);
}

TEST(VehicleMask, FewViewsDetermineNothing) {
  Drive drive;
  drive.vehicle = is_bonnet;
  EXPECT_FALSE(found(drive, VehicleMask::kFewestViews - 1).is_determined);
  EXPECT_FALSE(VehicleMask(kWidth, kHeight).find().is_determined);
  VehicleMask outside(kWidth, kHeight);
  outside.add(std::vector<PredictedPixel>{{60000, 60000, {}, {}}});
  EXPECT_EQ(outside.find().compared, 0u);
}

TEST(VehicleMask, ALargeImageHasCellsOfSeveralPixels) {
  const VehicleMask::Found large = VehicleMask(2448, 2048).find();
  EXPECT_EQ(large.cell_px, 4);
  EXPECT_EQ(large.columns, 612);
  EXPECT_EQ(large.rows, 512);
  EXPECT_EQ(large.cells.size(), 612u * 512);
}

}  // namespace
}  // namespace hueline::calibration
