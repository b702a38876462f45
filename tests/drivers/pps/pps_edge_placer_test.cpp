#include "drivers/pps/edge_placer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hueline::drivers {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

// The host clock and the wall clock of an invented computer: the wall clock leads by `lead` at host time 0 and runs
// `ppm` fast.
constexpr nanoseconds kLead = seconds(1'700'000'000);
struct Wall {
  nanoseconds lead = kLead;
  std::int64_t ppm = 0;
  nanoseconds at(nanoseconds host) const { return host + lead + host / 1'000'000 * ppm; }
  ClockReading read(nanoseconds host) const { return {HostTime(host), {host - at(host), nanoseconds(40)}}; }
};

TEST(EdgePlacer, UndisturbedEdgeIsExact) {
  const Wall wall;
  const auto placed =
      place_edge(wall.at(milliseconds(1050)), wall.read(milliseconds(1000)), wall.read(milliseconds(1100)));
  ASSERT_TRUE(placed);
  EXPECT_EQ(*placed, HostTime(milliseconds(1050)));
}

TEST(EdgePlacer, SlewIsNoStepAndIsInterpolated) {
  const Wall wall{kLead, 500};
  const auto before = wall.read(seconds(10)), after = wall.read(seconds(12));
  EXPECT_FALSE(step_between(before, after));
  const auto placed = place_edge(wall.at(milliseconds(10'500)), before, after);
  ASSERT_TRUE(placed);
  // Two seconds at 500 ppm are 1 ms. Interpolation leaves less than a microsecond of it.
  EXPECT_LT(std::chrono::abs(*placed - HostTime(milliseconds(10'500))), microseconds(1));
}

TEST(EdgePlacer, AStepIsMeasuredWithItsSign) {
  const Wall wall, forward{kLead + hours(1)};
  const auto step = step_between(wall.read(seconds(1)), forward.read(seconds(2)));
  ASSERT_TRUE(step);
  EXPECT_EQ(*step, hours(1));
}

// The property that matters: whatever the clock is set to, and whenever, an edge that is placed is right. A step that
// is longer than the wait never costs an edge.
TEST(EdgePlacer, AnyStepAtAnyMomentNeverMovesAnEdge) {
  std::mt19937_64 random(1);
  const nanoseconds begin = seconds(5), end = begin + milliseconds(100);
  int placed_edges = 0, refused_edges = 0;
  for (int i = 0; i < 20'000; ++i) {
    const nanoseconds edge = begin + nanoseconds(random() % 100'000'000),
                      set_at = begin + nanoseconds(random() % 100'000'000);
    const double size = std::pow(10.0, -3.5 + static_cast<double>(random() % 1000) / 100);  // 0.3 ms ... 38 days
    const nanoseconds step = from_seconds((random() & 1) ? size : -size);
    const Wall old_wall, new_wall{kLead + step};
    const nanoseconds stamp = (edge < set_at ? old_wall : new_wall).at(edge);
    const auto placed = place_edge(stamp, old_wall.read(begin), new_wall.read(end));
    if (placed) {
      ++placed_edges;
      // The wrong reading is off by the whole step. The right one is exact.
      ASSERT_LT(std::chrono::abs(*placed - HostTime(edge)), microseconds(1)) << to_seconds(step);
    } else {
      ++refused_edges;
      ASSERT_LT(std::chrono::abs(step), milliseconds(101)) << "a step longer than the wait leaves one answer";
    }
  }
  EXPECT_GT(placed_edges, 12'000);
  EXPECT_GT(refused_edges, 1'000);
}

TEST(EdgePlacer, AnEdgeOutsideBothReadingsIsRefused) {
  const Wall wall, between{kLead + hours(2)};
  // The clock is set forward and back between the readings: they do not differ, but the stamp is two hours away.
  EXPECT_FALSE(
      place_edge(between.at(milliseconds(1050)), wall.read(milliseconds(1000)), wall.read(milliseconds(1100))));
}

}  // namespace
}  // namespace hueline::drivers
