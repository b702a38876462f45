#include "fusion/beam_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hueline::fusion {
namespace {

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
    return beams.ask(seen.cell[0], seen.nearness[0]);
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

}  // namespace
}  // namespace hueline::fusion
