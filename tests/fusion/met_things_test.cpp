#include "fusion/met_things.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace hueline::fusion {
namespace {

constexpr float kTolerance_m = 0.15f, kShare = 0.02f;
const DirectionGrid kGrid(0.0075);
std::uint32_t cell(int row, int column) { return static_cast<std::uint32_t>(row * kGrid.columns + column); }

TEST(MetThings, AreAskedForOnOneSideOfTheMoment) {
  MetThings met;
  met.add(true, cell(200, 300), 0.1f);
  met.sort();
  EXPECT_TRUE(met.was_met(kGrid, true, cell(200, 300), 0.1f, kTolerance_m, kShare));
  EXPECT_FALSE(met.was_met(kGrid, false, cell(200, 300), 0.1f, kTolerance_m, kShare));
  EXPECT_FALSE(MetThings().was_met(kGrid, true, cell(200, 300), 0.1f, kTolerance_m, kShare));
}

TEST(MetThings, AreAsFarAwayAsThePlace) {
  MetThings met;
  met.add(false, cell(200, 300), 1 / 10.0f);
  met.sort();
  for (const float distance : {9.75f, 10.25f})  // 0.15 m and 2 % of 10 m are 0.35 m
    EXPECT_TRUE(met.was_met(kGrid, false, cell(200, 300), 1 / distance, kTolerance_m, kShare)) << distance;
  for (const float distance : {9.5f, 10.5f})
    EXPECT_FALSE(met.was_met(kGrid, false, cell(200, 300), 1 / distance, kTolerance_m, kShare)) << distance;
}

TEST(MetThings, AreFoundAsALookAtEachOfThemFindsThem) {
  std::mt19937 random(7);
  const auto within = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  struct Point {
    int row, column;
    float nearness;
  };
  for (int round = 0; round < 50; ++round) {
    const auto point = [&] {
      return Point{within(100, 130), within(100, 130), 1 / static_cast<float>(within(80, 120)) * 10};
    };
    std::vector<Point> points;
    MetThings met;
    for (int i = 0; i < 40; ++i) {
      points.push_back(point());
      met.add(true, cell(points.back().row, points.back().column), points.back().nearness);
    }
    met.sort();
    for (int i = 0; i < 100; ++i) {
      const Point place = point();
      const bool is_there = std::any_of(points.begin(), points.end(), [&](const Point& p) {
        const float near = std::max(p.nearness, place.nearness), far = std::min(p.nearness, place.nearness);
        return std::abs(p.row - place.row) <= MetThings::kBeside &&
               std::abs(p.column - place.column) <= MetThings::kBeside &&
               near * (1 - kTolerance_m * place.nearness) <= far * (1 + kShare);
      });
      EXPECT_EQ(met.was_met(kGrid, true, cell(place.row, place.column), place.nearness, kTolerance_m, kShare),
                is_there);
    }
  }
}

TEST(MetThings, AtTheEndsOfTheGridAreNoTrap) {
  MetThings met;
  const auto last = static_cast<std::uint32_t>(kGrid.size() - 1);
  met.add(true, 0, 0.2f);
  met.add(true, last, 0.2f);
  met.sort();
  EXPECT_TRUE(met.was_met(kGrid, true, 2, 0.2f, kTolerance_m, kShare));
  EXPECT_TRUE(met.was_met(kGrid, true, last - 1, 0.2f, kTolerance_m, kShare));
  EXPECT_FALSE(met.was_met(kGrid, true, last - 10, 0.2f, kTolerance_m, kShare));
}

}  // namespace
}  // namespace hueline::fusion
