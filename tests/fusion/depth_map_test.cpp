#include "fusion/depth_map.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/each_instruction_set.hpp"

namespace hueline::fusion {
namespace {
using Eigen::Vector3d;
using std::numbers::pi;

/// Where a head at the origin, with axes parallel to ENU, sees a place.
SeenPlaces seen_at(const DirectionGrid& grid, const Vector3d& p) {
  RelativePlaces places;
  places.x = {static_cast<float>(p.x())};
  places.y = {static_cast<float>(p.y())};
  places.z = {static_cast<float>(p.z())};
  SeenPlaces seen;
  locate(grid, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, places, seen);
  return seen;
}
void add(DepthMap& map, const Vector3d& p) {
  const SeenPlaces seen = seen_at(map.grid(), p);
  map.add(seen.cell[0], seen.nearness[0]);
}
LineOfSight look(const DepthMap& map, const Vector3d& p) {
  const SeenPlaces seen = seen_at(map.grid(), p);
  return map.look(seen.cell[0], seen.nearness[0]);
}

/// Points where the rings of a scanner at the head's centre meet a plane n * p = d, with rings `rings` apart.
std::vector<Vector3d> rings_on_plane(const Vector3d& n, double d, double rings) {
  std::vector<Vector3d> out;
  for (double elevation = -0.6; elevation < 0.3; elevation += rings)
    for (double azimuth = -pi; azimuth < pi; azimuth += 0.0035) {
      const Vector3d ray(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation));
      const double distance = d / n.dot(ray);
      if (distance > 1 && distance < 60) out.push_back(distance * ray);
    }
  return out;
}

TEST(DepthMap, KnowsNothingWithoutPoints) {
  DepthMap map({});
  map.close();
  EXPECT_EQ(look(map, {3, 1, 0}), LineOfSight::Clear);
  EXPECT_EQ(look(map, {-300, 1, 20}), LineOfSight::Clear);
}

TEST(DepthMap, KnowsWhereNoBeamWent) {
  DepthMap map({});
  for (const Vector3d& p : rings_on_plane({0, 0, -1}, 2.5, 0.0349)) add(map, p);
  map.close();
  const auto is_blank = [&](const Vector3d& p) { return map.is_blank(seen_at(map.grid(), p).cell[0]); };
  // The lowest ring meets the ground 3.65 m from the head. Between the rings, 2 degrees apart, the gaps are closed.
  for (double x = 4; x < 8; x += 0.05) EXPECT_FALSE(is_blank({x, 0, -2.5})) << x;
  for (double x = 1; x < 3.5; x += 0.05) EXPECT_TRUE(is_blank({x, 0, -2.5})) << x;
  EXPECT_TRUE(is_blank({10, 0, 1}));
}

TEST(DepthMap, ManyPointsAtOnceGiveTheMapThatEachAloneGives) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-1, 1), far(0.5, 60);
  const DirectionGrid grid(DepthMap::Config().cell);
  // More than one point in many cells, some too near for a map, and no whole number of vectors. The last ones are in
  // the grid's first and last cells.
  SeenPlaces seen;
  for (int i = 0; i < 20'003; ++i) {
    const Vector3d ray(anywhere(random), anywhere(random), 0.2 * anywhere(random));
    const SeenPlaces one = seen_at(grid, far(random) * ray.normalized());
    seen.cell.push_back(one.cell[0]);
    seen.nearness.push_back(one.nearness[0]);
  }
  for (const std::size_t cell : {std::size_t{0}, grid.size() - 1}) {
    seen.cell.push_back(static_cast<std::uint32_t>(cell));
    seen.nearness.push_back(0.1f);
  }
  const auto is_wanted = [](std::uint32_t i) { return i % 5 != 0; };
  DepthMap expected({});
  std::size_t added = 0;
  for (std::uint32_t i = 0; i < seen.cell.size(); ++i)
    if (is_wanted(i)) expected.add(seen.cell[i], seen.nearness[i]), ++added;
  expected.close();
  test::with_each_instruction_set([&] {
    DepthMap map({});
    std::size_t asked = 0;
    for (int again = 0; again < 2; ++again)
      map.add(seen, [&](std::uint32_t i) {
        ++asked;
        return is_wanted(i);
      });
    map.close();
    for (std::uint32_t cell = 0; cell < grid.size(); ++cell) {
      ASSERT_EQ(map.nearest_point(cell), expected.nearest_point(cell)) << cell;
      ASSERT_EQ(map.surface(cell), expected.surface(cell)) << cell;
    }
    // Of the second time only those that are not wanted may still be nearer.
    EXPECT_LT(asked, added + 2 * (seen.cell.size() - added));
  });
}

TEST(DepthMap, NoPlaneHidesItself) {
  for (const Vector3d& n : {Vector3d(0, 0, -1), Vector3d(1, 0, 0), Vector3d(0.6, 0.8, 0), Vector3d(0.3, 0, -0.954)}) {
    for (const double rings : {0.004, 0.0232, 0.0349}) {
      DepthMap map({});
      const auto points = rings_on_plane(n.normalized(), 2.5, rings);
      ASSERT_GT(points.size(), 2000u);
      for (const Vector3d& p : points) add(map, p);
      map.close();
      std::size_t hidden = 0, clear = 0;
      for (const Vector3d& p : points) {
        hidden += look(map, p) == LineOfSight::Hidden;
        clear += look(map, p) == LineOfSight::Clear;
      }
      EXPECT_EQ(hidden, 0u) << n.transpose() << ", rings " << rings;
      // On a wall the lines are clear. The rings on the ground lie in steps of distance, which look like outlines.
      const bool is_wall = n.z() == 0;
      EXPECT_GT(static_cast<double>(clear), (is_wall ? 0.93 : 0.25) * static_cast<double>(points.size()))
          << n.transpose() << ", rings " << rings;
    }
  }
}

TEST(DepthMap, WhatIsBetweenTheRingsOfANearSurfaceIsHidden) {
  DepthMap map({});
  // A board of 2 x 2 m at 5 m, seen by rings 2 degrees apart, before a wall at 12 m.
  for (double up = -1; up <= 1; up += 5 * std::tan(2 * pi / 180))
    for (double right = -1; right <= 1; right += 0.02) add(map, {5, right, up});
  map.close();
  for (double up = -0.9; up < 0.9; up += 0.05)
    for (double right = -0.9; right < 0.9; right += 0.05) {
      const Vector3d behind = 12.0 / 5 * Vector3d(5, right, up);
      EXPECT_EQ(look(map, behind), LineOfSight::Hidden) << right << ' ' << up;
      EXPECT_NE(look(map, {4.95, right, up}), LineOfSight::Hidden);
    }
  // The outline does not grow: three cells beside it nothing is hidden, and beyond the guard the line is clear.
  for (double up = -0.9; up < 0.9; up += 0.05) {
    EXPECT_NE(look(map, 12.0 / 5 * Vector3d(5, 1.1, up)), LineOfSight::Hidden) << up;
    EXPECT_EQ(look(map, 12.0 / 5 * Vector3d(5, 1.35, up)), LineOfSight::Clear) << up;
  }
}

TEST(DepthMap, PointsSayWhetherAClosedGapIsASurface) {
  const auto judged = [](const DepthMap& map, const Vector3d& p) {
    const SeenPlaces seen = seen_at(map.grid(), p);
    return map.look_among_points(seen.cell[0], seen.nearness[0]);
  };
  // Leaves at 5 m, 1.8 degrees apart, which closing joins to one surface, before a wall at 12 m.
  DepthMap leaves({}), board({});
  for (double up = -0.64; up <= 0.65; up += 0.16)
    for (double right = -0.64; right <= 0.65; right += 0.16) add(leaves, {5, right, up});
  for (double up = -0.64; up <= 0.65; up += 0.02)
    for (double right = -0.64; right <= 0.65; right += 0.02) add(board, {5, right, up});
  leaves.close();
  board.close();
  for (double up = -0.48; up < 0.47; up += 0.16)
    for (double right = -0.48; right < 0.47; right += 0.16) {
      const Vector3d between = 12.0 / 5 * Vector3d(5, right + 0.08, up + 0.08),
                     behind = 12.0 / 5 * Vector3d(5, right, up);
      ASSERT_EQ(look(leaves, between), LineOfSight::Hidden) << right << ' ' << up;
      EXPECT_EQ(judged(leaves, between), LineOfSight::Behind) << right << ' ' << up;
      EXPECT_EQ(judged(leaves, behind), LineOfSight::Hidden) << right << ' ' << up;
      EXPECT_EQ(judged(board, between), LineOfSight::Hidden) << right << ' ' << up;
    }
  // One twig before the wall: its own cell is covered, and what lies beside it is not behind it.
  DepthMap twig({});
  add(twig, {5, 0.01, 0.01});
  twig.close();
  EXPECT_LE(judged(twig, {12, 0.024, 0.024}), LineOfSight::Covered);
  EXPECT_EQ(judged(twig, {12, 3, 0.024}), LineOfSight::Clear);
  EXPECT_EQ(judged(twig, {5, 0.01, 0.01}), LineOfSight::Clear);
}

TEST(DepthMap, TheOrderOfThePointsDoesNotMatter) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-20, 20);
  std::vector<Vector3d> points(20'000);
  for (Vector3d& p : points) {
    p.x() = place(random);
    p.y() = place(random);
    p.z() = place(random);
  }
  DepthMap one({}), other({}), later({});
  for (const Vector3d& p : points) add(one, p);
  one.close();
  for (std::size_t i = 0; i < points.size(); ++i) {
    add(later, points[i]);
    if (i % 5000 == 0) later.close();
  }
  later.close();
  std::shuffle(points.begin(), points.end(), random);
  for (const Vector3d& p : points) add(other, p);
  other.close();
  for (const Vector3d& p : points) {
    ASSERT_EQ(look(one, p), look(other, p));
    ASSERT_EQ(look(one, p), look(later, p));
  }
}

TEST(DepthMap, MemoryOfAnEarlierMapHoldsNothing) {
  const auto places = [](unsigned seed, std::size_t count, double from_east) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-20, 20);
    std::vector<Vector3d> out(count);
    for (Vector3d& p : out)
      for (double* x : {&p.x(), &p.y(), &p.z()}) *x = place(random);
    for (Vector3d& p : out) p.x() = std::max(from_east, p.x());
    return out;
  };
  const std::shared_ptr<DepthMap::Memory> memory = DepthMap::make_memory();
  const std::vector<Vector3d> asked = places(1, 50'000, -20);
  unsigned seed = 2;
  // Maps of all directions and of a few, each in the memory of the one before.
  for (const double from_east : {-20.0, 2.0, -20.0, 15.0}) {
    DepthMap fresh({}), later({}, memory);
    const std::vector<Vector3d> added = places(++seed, 20'000, from_east);
    for (DepthMap* map : {&fresh, &later}) {
      for (const Vector3d& p : added) add(*map, p);
      map->close();
    }
    for (const Vector3d& p : asked) {
      const SeenPlaces seen = seen_at(fresh.grid(), p);
      const std::uint32_t cell = seen.cell[0];
      const float nearness = seen.nearness[0];
      ASSERT_EQ(fresh.look_among_points(cell, nearness), later.look_among_points(cell, nearness));
      ASSERT_EQ(fresh.is_blank(cell), later.is_blank(cell));
      ASSERT_EQ(fresh.meets(cell, nearness), later.meets(cell, nearness));
    }
    for (const Vector3d& p : asked) add(later, p);  // which it does not close
  }
}

TEST(DepthMap, HasNoSeamAllAround) {
  // A sphere of points hides a larger one in every direction.
  DepthMap map({});
  const auto on_sphere = [](int i, int count) {
    const double z = 1 - 2 * (i + 0.5) / count, turn = pi * (3 - std::sqrt(5.0)) * i, r = std::sqrt(1 - z * z);
    return Vector3d(r * std::cos(turn), r * std::sin(turn), z);
  };
  for (int i = 0; i < 60'000; ++i) add(map, 10 * on_sphere(i, 60'000));
  map.close();
  for (int i = 0; i < 50'000; ++i) {
    if (std::abs(on_sphere(i, 50'000).z()) > 0.96) continue;  // near the poles gaps are closed less
    ASSERT_EQ(look(map, 11 * on_sphere(i, 50'000)), LineOfSight::Hidden) << on_sphere(i, 50'000).transpose();
    ASSERT_EQ(look(map, 10 * on_sphere(i, 50'000)), LineOfSight::Clear) << on_sphere(i, 50'000).transpose();
  }
}

}  // namespace
}  // namespace hueline::fusion
