#include "fusion/direction_grid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace hueline::fusion {
namespace {
using std::numbers::pi;

RelativePlaces places_around(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-40, 40);
  RelativePlaces places;
  for (std::size_t i = 0; i < count; ++i) {
    places.x.push_back(place(random));
    places.y.push_back(place(random));
    places.z.push_back(place(random));
  }
  return places;
}

TEST(DirectionGrid, FindsDirectionDistanceAndParallax) {
  const DirectionGrid grid(0.01);
  const Eigen::Matrix3f R =
      (Eigen::AngleAxisf(0.7f, Eigen::Vector3f::UnitZ()) * Eigen::AngleAxisf(-0.3f, Eigen::Vector3f(0.6f, 0.8f, 0)))
          .toRotationMatrix();
  RelativeHead head{{}, {1.5f, -0.7f, 0.4f}};
  for (int k = 0; k < 9; ++k) head.R_head_enu[static_cast<std::size_t>(k)] = R(k / 3, k % 3);
  const RelativePlaces places = places_around(1003, 5);
  SeenPlaces seen;
  locate(grid, head, places, seen);
  ASSERT_EQ(seen.cell.size(), places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d from_scanner(places.x[i], places.y[i], places.z[i]);
    const Eigen::Vector3d from_head = from_scanner + Eigen::Vector3d(1.5, -0.7, 0.4);
    const Eigen::Vector3d h = R.cast<double>() * from_head;
    EXPECT_NEAR(seen.nearness[i], 1 / h.norm(), 1e-5 / h.norm());
    EXPECT_NEAR(seen.parallax[i], (from_head.normalized() - from_scanner.normalized()).norm(), 1e-5);
    const double turn = std::atan2(h.y(), h.x()) < 0 ? std::atan2(h.y(), h.x()) + 2 * pi : std::atan2(h.y(), h.x());
    const double column = turn / (2 * pi) * grid.columns, row = (std::asin(h.z() / h.norm()) / pi + 0.5) * grid.rows;
    // The angles of the grid deviate from true ones by 0.3 degrees at most, which is half a cell.
    EXPECT_NEAR(seen.cell[i] % static_cast<std::uint32_t>(grid.columns) + 0.5, column, 1.1) << h.transpose();
    EXPECT_NEAR(seen.cell[i] / static_cast<std::uint32_t>(grid.columns) + 0.5, row, 1.1) << h.transpose();
  }
}

TEST(DirectionGrid, SeesAPlaceFromTheLensWhoseAxisIsNearest) {
  const DirectionGrid grid(0.01);
  const std::array<LensEye, 3> eyes{
      {{{1, 0, 0}, {0.06f, 0, 0}}, {{-1, 0, 0}, {-0.05f, 0, 0.01f}}, {{0, 0, 1}, {0, 0.02f, 0.08f}}}};
  RelativeHead head{{0, 1, 0, -1, 0, 0, 0, 0, 1}, {0.1f, 0.2f, -0.3f}, eyes};
  const RelativePlaces places = places_around(61, 3);
  SeenPlaces seen, from_lens;
  locate(grid, head, places, seen);
  std::array<int, 3> used{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto h = head.place(places.x[i], places.y[i], places.z[i]);
    const auto along = [&](const LensEye& eye) { return h[0] * eye.axis[0] + h[1] * eye.axis[1] + h[2] * eye.axis[2]; };
    const auto eye = std::max_element(eyes.begin(), eyes.end(),
                                      [&](const LensEye& a, const LensEye& b) { return along(a) < along(b); });
    ++used[static_cast<std::size_t>(eye - eyes.begin())];
    // The head's centre is where the lens is; x of the head is y of the world.
    const auto& c = eye->centre;
    const RelativeHead lens{head.R_head_enu, {head.origin[0] + c[1], head.origin[1] - c[0], head.origin[2] - c[2]}};
    locate(grid, lens, {{places.x[i]}, {places.y[i]}, {places.z[i]}}, from_lens);
    EXPECT_NEAR(seen.nearness[i], from_lens.nearness[0], 1e-5f * from_lens.nearness[0]);
    EXPECT_NEAR(seen.parallax[i], from_lens.parallax[0], 1e-5f);
    const auto columns = static_cast<std::uint32_t>(grid.columns);
    EXPECT_NEAR(seen.cell[i] / columns, from_lens.cell[0] / columns, 1.0);
    const auto apart = (seen.cell[i] % columns + columns - from_lens.cell[0] % columns) % columns;
    EXPECT_THAT(apart, testing::AnyOf(testing::Le(1u), testing::Eq(columns - 1)));
  }
  EXPECT_THAT(used, testing::Each(testing::Gt(5)));
}

TEST(DirectionGrid, APlaceIsSeenAlikeAnywhereInABatch) {
  const DirectionGrid grid(0.01);
  const RelativeHead head{{0, 1, 0, -1, 0, 0, 0, 0, 1}, {0.1f, 0.2f, -0.3f}};
  const RelativePlaces places = places_around(61, 9);
  SeenPlaces all, one;
  locate(grid, head, places, all);
  for (std::size_t i = 0; i < places.size(); ++i) {
    locate(grid, head, {{places.x[i]}, {places.y[i]}, {places.z[i]}}, one);
    EXPECT_EQ(one.cell[0], all.cell[i]);
    EXPECT_EQ(one.nearness[0], all.nearness[i]);
    EXPECT_EQ(one.parallax[0], all.parallax[i]);
  }
}

TEST(DirectionGrid, KeepsEveryDirectionInside) {
  const DirectionGrid grid(0.01);
  const RelativeHead head{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  RelativePlaces places;
  for (const float x : {-1.0f, -0.0f, 0.0f, 1.0f})
    for (const float y : {-1.0f, -0.0f, 0.0f, 1.0f})
      for (const float z : {-1.0f, -0.0f, 0.0f, 1.0f, 1e-30f, -1e-30f}) {
        places.x.push_back(x);
        places.y.push_back(y);
        places.z.push_back(z);
      }
  SeenPlaces seen;
  locate(grid, head, places, seen);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_LT(seen.cell[i], grid.size());
    EXPECT_EQ(seen.nearness[i] == 0.0f, places.x[i] == 0.0f && places.y[i] == 0.0f && std::abs(places.z[i]) < 0.5f);
  }
}

}  // namespace
}  // namespace hueline::fusion
