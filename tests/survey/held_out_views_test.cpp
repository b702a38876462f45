#include "survey/held_out_views.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/survey/standing_vehicle.hpp"

namespace hueline::survey {
namespace {

using namespace hueline::test;

constexpr double kSeconds = 4, kStep_deg = 0.6;

/// Returns of a grid of directions, once each 0.1 s, at the range that `range` gives; 0: no return.
std::vector<StampedLaserBatch> grid(const StandingVehicle& vehicle,
                                    const std::function<double(double azimuth, double elevation)>& range) {
  std::vector<StampedLaserBatch> out;
  for (int i = 0; i < static_cast<int>(kSeconds * 10); ++i) {
    StampedLaserBatch batch;
    batch.sensor = kLaser;
    batch.packet_sequence = static_cast<std::uint64_t>(i);
    batch.time = at(0.1 * i);
    for (int column = -50; column <= 50; ++column)
      for (int row = -25; row <= 25; ++row)
        if (const double r = range(kStep_deg * column, kStep_deg * row); r > 0)
          batch.returns.push_back(vehicle.seen_at(kStep_deg * column, kStep_deg * row, r, 0, 0));
    out.push_back(std::move(batch));
  }
  return out;
}

/// Four images a second; every fourth is left out, and shows what `left_out` says.
std::vector<PredictedView> views(const StandingVehicle& vehicle, const std::vector<StampedLaserBatch>& batches,
                                 const Image& image, const Image& left_out, int threads = 1) {
  std::vector<Exposure> exposures;
  for (int i = 0; i < static_cast<int>(kSeconds * 4); ++i)
    exposures.push_back(make_exposure(static_cast<std::uint32_t>(i), 0.25 * i + 0.05, i % 4 == 2 ? left_out : image));
  std::vector<PredictedView> out;
  HeldOutViews held_out({}, vehicle.rig, {.every = 4, .threads = threads},
                        [&](const PredictedView& view) { out.push_back(view); });
  vehicle.feed(held_out, batches, exposures, kSeconds);
  held_out.finish();
  return out;
}

std::size_t pixels_of(const std::vector<PredictedView>& all) {
  std::size_t count = 0;
  for (const PredictedView& view : all) count += view.pixels.size();
  return count;
}

TEST(HeldOutViews, ThePredictionNeverHasTheColourOfTheImageThatWasLeftOut) {
  const StandingVehicle vehicle;
  const Image grey = vehicle.image([](double, double, int) { return 100.0; });
  const Image red = vehicle.image([](double, double, int channel) { return channel == 0 ? 220.0 : 20.0; });
  const auto all = views(vehicle, grid(vehicle, [](double, double) { return 8.0; }), grey, red);
  ASSERT_GT(pixels_of(all), 1000u);
  for (const PredictedView& view : all) {
    EXPECT_EQ(view.exposure % 4, 2u);
    for (const auto& [x, y, predicted, seen] : view.pixels) {
      EXPECT_EQ(predicted, (std::array<std::uint8_t, 3>{100, 100, 100}));
      EXPECT_EQ(seen, (std::array<std::uint8_t, 3>{220, 20, 20}));
    }
  }
}

TEST(HeldOutViews, APointPredictsThePixelThatShowsIt) {
  const StandingVehicle vehicle;
  const Image ramp = vehicle.image([](double azimuth, double elevation, int channel) {
    return channel == 0 ? 128 + 2 * azimuth : (channel == 1 ? 128 + 4 * elevation : 128 - azimuth - elevation);
  });
  const auto batches = grid(vehicle, [](double azimuth, double) { return azimuth < 0 ? 8.0 : 20.0; });
  const auto all = views(vehicle, batches, ramp, ramp);
  ASSERT_GT(pixels_of(all), 1000u);
  std::set<std::array<std::uint8_t, 3>> colours;
  for (const PredictedView& view : all)
    for (const auto& [x, y, predicted, seen] : view.pixels) {
      colours.insert(predicted);
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(predicted[c], seen[c], 3);
    }
  EXPECT_GT(colours.size(), 300u) << "all over the ramp";
}

TEST(HeldOutViews, WhatLiesBehindThePointsAroundItPredictsNothing) {
  const StandingVehicle vehicle;
  const Image grey = vehicle.image([](double, double, int) { return 100.0; });
  // A fence before a wall: of each 2 x 2 directions one meets the fence and the opposite one the wall.
  const auto is_odd = [](double angle) { return std::lround(angle / kStep_deg) % 2 != 0; };
  const auto near = [&](double azimuth, double elevation) { return is_odd(azimuth) || is_odd(elevation) ? 0.0 : 5.0; };
  const auto behind = [&](double far_m) {
    return [=](double azimuth, double elevation) {
      const bool is_wall = is_odd(azimuth) && is_odd(elevation) && std::abs(azimuth) < 25 && std::abs(elevation) < 10;
      return is_wall ? far_m : near(azimuth, elevation);
    };
  };
  const std::size_t front = pixels_of(views(vehicle, grid(vehicle, near), grey, grey));
  EXPECT_EQ(pixels_of(views(vehicle, grid(vehicle, behind(10)), grey, grey)), front);
  EXPECT_GT(pixels_of(views(vehicle, grid(vehicle, behind(5.1)), grey, grey)), front * 3 / 2);
}

TEST(HeldOutViews, PredictEveryLensThatContainsAPointIfTheyAreAskedTo) {
  StandingVehicle vehicle;
  vehicle.rig.head.lenses[0].masks = {{{-1, -1}, {5000, -1}, {5000, 5000}, {-1, 5000}}};  // it gives no colour
  const Image image = vehicle.image([](double, double, int) { return 100.0; });
  std::array<std::size_t, 2> pixels_ahead{}, pixels{};
  for (const bool every_lens : {false, true}) {
    HeldOutViews held_out({}, vehicle.rig, {.every = 4, .every_lens = every_lens}, [&](const PredictedView& view) {
      for (const auto& pixel : view.pixels) {
        EXPECT_LT(pixel.x, vehicle.rig.head.lenses[view.lens].intrinsics.width);
        EXPECT_LT(pixel.y, vehicle.rig.head.lenses[view.lens].intrinsics.height);
      }
      pixels[every_lens ? 1 : 0] += view.pixels.size();
      pixels_ahead[every_lens ? 1 : 0] += view.lens == 0 ? view.pixels.size() : 0;
    });
    std::vector<Exposure> exposures;
    for (int i = 0; i < static_cast<int>(kSeconds * 4); ++i)
      exposures.push_back(make_exposure(static_cast<std::uint32_t>(i), 0.25 * i + 0.05, image));
    vehicle.feed(held_out, grid(vehicle, [](double, double) { return 8.0; }), exposures, kSeconds);
    held_out.finish();
  }
  EXPECT_EQ(pixels_ahead[0], 0u);
  EXPECT_GT(pixels_ahead[1], 100u);
  EXPECT_GT(pixels[1], pixels[0]);
}

TEST(HeldOutViews, DoNotDependOnTheNumberOfThreads) {
  const StandingVehicle vehicle;
  const Image ramp = vehicle.image([](double azimuth, double elevation, int) { return 128 + azimuth + elevation; });
  const auto batches = grid(vehicle, [](double azimuth, double) { return 8.0 + 0.1 * azimuth; });
  const auto one = views(vehicle, batches, ramp, ramp, 1), three = views(vehicle, batches, ramp, ramp, 3);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].exposure, three[i].exposure);
    EXPECT_EQ(one[i].lens, three[i].lens);
    ASSERT_EQ(one[i].pixels.size(), three[i].pixels.size());
    for (std::size_t k = 0; k < one[i].pixels.size(); ++k) {
      EXPECT_EQ(one[i].pixels[k].predicted, three[i].pixels[k].predicted);
      EXPECT_EQ(one[i].pixels[k].seen, three[i].pixels[k].seen);
    }
  }
}

}  // namespace
}  // namespace hueline::survey
