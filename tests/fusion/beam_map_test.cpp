#include "fusion/beam_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "tests/support/each_instruction_set.hpp"

namespace hueline::fusion {
namespace {

enum class Presence { Unknown, Free, Occupied };

/// A turn of a scanner at the origin with rings 2 degrees apart, before a wall in the east.
class BeforeAWall : public testing::Test {
 protected:
  BeforeAWall() {
    for (double elevation = -0.25; elevation < 0.25; elevation += 2 * std::numbers::pi / 180)
      for (double azimuth = -0.6; azimuth < 0.6; azimuth += 0.0035) {
        const double x = 12, y = 12 * std::tan(azimuth), z = std::hypot(x, y) * std::tan(elevation);
        const bool meets_post = std::abs(8 / x * y - 1.0) < 0.3;
        const double part = meets_post ? 8 / x : 1.0;
        const SeenPlaces seen = at(part * x, part * y, part * z);
        beams.add(seen.cell[0], seen.nearness[0]);
      }
    beams.finish();
  }
  SeenPlaces at(double x, double y, double z) const {
    SeenPlaces seen;
    locate(grid, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}},
           {{static_cast<float>(x)}, {static_cast<float>(y)}, {static_cast<float>(z)}}, seen);
    return seen;
  }
  Presence ask(double x, double y, double z) const {
    const SeenPlaces seen = at(x, y, z);
    PresenceCount count;
    beams.count(seen, &count);
    EXPECT_LE(count.free() + count.occupied(), 1U);
    return count.free() > 0 ? Presence::Free : count.occupied() > 0 ? Presence::Occupied : Presence::Unknown;
  }
  DirectionGrid grid{0.01};
  BeamMap beams{grid};
};

TEST_F(BeforeAWall, TellsFreeFromOccupiedPlaces) {
  int free = 0, unknown = 0, occupied = 0;
  for (double z = -1.5; z < 1.5; z += 0.02) {
    const Presence before_wall = ask(6, -2, z / 2), on_wall = ask(12, -4, z), behind = ask(20, -20 / 3.0, z * 20 / 12);
    EXPECT_NE(before_wall, Presence::Occupied) << z;
    EXPECT_NE(on_wall, Presence::Free) << z;
    EXPECT_EQ(behind, Presence::Unknown) << z;
    EXPECT_NE(ask(8, 1, z), Presence::Free) << z;  // the post
    free += before_wall == Presence::Free;
    occupied += on_wall == Presence::Occupied;
    unknown += before_wall == Presence::Unknown;
  }
  // The rings leave gaps, of which nothing is said.
  EXPECT_GT(free, 90);
  EXPECT_GT(occupied, 90);
  EXPECT_GT(unknown, 5);
}

TEST_F(BeforeAWall, SaysNothingOfDirectionsWithoutBeams) {
  EXPECT_EQ(ask(-6, 0, 0), Presence::Unknown);
  EXPECT_EQ(ask(1, 0, 5), Presence::Unknown);
  EXPECT_EQ(ask(0, 0, 0), Presence::Unknown);
}

TEST_F(BeforeAWall, KnowsTheRowsThatTheBeamsReachAndThoseBesideThem) {
  const auto cell = [&](int row, int column) { return static_cast<std::uint32_t>(row * grid.columns + column); };
  for (const int row : {0, 40, grid.rows - 1})
    test::with_each_instruction_set([&] {
      BeamMap one(grid);
      one.add(cell(row, 7), 1 / 30.0f);
      one.finish();
      SeenPlaces seen;
      for (int r = 0; r < grid.rows; ++r)
        for (const int column : {5, 7, 8}) {
          seen.cell.push_back(cell(r, column));
          seen.nearness.push_back(0.1f);
        }
      std::vector<PresenceCount> counts(seen.cell.size());
      one.count(seen, counts.data());
      for (std::size_t i = 0; i < counts.size(); ++i) {
        const bool is_beside = std::abs(static_cast<int>(i) / 3 - row) <= 1 && i % 3 != 0;
        ASSERT_EQ(counts[i].free(), is_beside ? 1U : 0U) << row << " " << i;
      }
    });
  BeamMap none(grid);
  none.finish();
  PresenceCount count;
  none.count(at(6, -2, 0), &count);
  EXPECT_EQ(count.bits, 0U);
}

TEST_F(BeforeAWall, CountsEachOfManyPlacesAsItCountsOne) {
  // As many as fill no whole number of vectors.
  RelativePlaces places;
  for (int i = 0; i < 1001; ++i) {
    const double part = 0.3 + 0.0011 * i;
    places.x.push_back(static_cast<float>(12 * part));
    places.y.push_back(static_cast<float>(-0.004 * i));
    places.z.push_back(static_cast<float>(0.001 * (i % 300)));
  }
  SeenPlaces seen;
  locate(grid, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, places, seen);
  std::vector<PresenceCount> counts(places.size());
  for (int turn = 0; turn < 3; ++turn) beams.count(seen, counts.data());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Presence one = ask(places.x[i], places.y[i], places.z[i]);
    EXPECT_EQ(counts[i].free(), one == Presence::Free ? 3U : 0U) << i;
    EXPECT_EQ(counts[i].occupied(), one == Presence::Occupied ? 3U : 0U) << i;
  }
}

TEST_F(BeforeAWall, CountsUpToALimitThatLetsSumsFit) {
  const SeenPlaces free = at(6, -2, 0), wall = at(12, -4, 0);
  PresenceCount of_free, of_wall;
  for (int turn = 0; turn < 1500; ++turn) {
    beams.count(free, &of_free);
    beams.count(wall, &of_wall);
  }
  EXPECT_EQ(of_free.free(), PresenceCount::kMost);
  EXPECT_EQ(of_wall.occupied(), PresenceCount::kMost);
  PresenceCount sum;
  for (int i = 0; i < 65; ++i) sum += of_wall;
  EXPECT_EQ(sum.occupied(), 65 * PresenceCount::kMost);
  EXPECT_EQ(sum.free(), 0U);
}

}  // namespace
}  // namespace hueline::fusion
