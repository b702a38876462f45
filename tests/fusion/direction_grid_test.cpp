#include "fusion/direction_grid.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
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
