#include "products/seen_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "core/calendar.hpp"

namespace hueline::products {
namespace {

/// A lens at the origin that looks north, and walls of points across its axis.
class SeenPointsTest : public testing::Test {
 protected:
  SeenPointsTest() {
    mount_.intrinsics.width = 200, mount_.intrinsics.height = 160;
    mount_.intrinsics.focal_px = {100, 100};
    mount_.intrinsics.principal_point_px = {99.5, 79.5};
    picture_.time = now_;
    Eigen::Matrix3d R;  // right is east, down is down, forward is north
    R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    picture_.T_enu_lens.rotation = Eigen::Quaterniond(R);
  }
  ColouredPoint point(double east, double north, double up, std::uint8_t moving = 0, double later_s = 0) const {
    ColouredPoint out;
    out.east = east, out.north = north, out.up = up;
    out.moving = moving;
    out.time = now_ + from_seconds(later_s);
    return out;
  }
  /// A wall of 6 m x 2 m around the axis, in steps of 0.1 m.
  CloudBlock wall(double north, std::uint8_t moving = 0, double later_s = 0) const {
    CloudBlock out;
    for (int i = -30; i <= 30; ++i)
      for (int k = -10; k <= 10; ++k) out.points.push_back(point(0.1 * i, north, 0.1 * k, moving, later_s));
    return out;
  }
  std::vector<std::uint32_t> numbers(SeenPoints& seen, const std::vector<ColouredPoint>& points) {
    fusion::WorkerPool pool(2);
    const std::vector<LensPicture> lenses{LensPicture(mount_, LensPixels::Recorded)};
    const auto found = seen.find(points, std::vector{picture_}, lenses, pool);
    std::vector<std::uint32_t> out;
    for (const Observation& one : found.at(0)) out.push_back(one.point);
    return out;
  }
  using Numbers = std::vector<std::uint32_t>;

  GpsTime now_ = from_gps_week(2400, std::chrono::seconds(1000));
  fusion::LensMount mount_;
  TakenPicture picture_;
};

TEST_F(SeenPointsTest, WhatStandsInFrontHides) {
  // On the wall, behind it, beside it, above it, behind the lens, beyond the picture, and too far.
  const std::vector<ColouredPoint> points{point(0.5, 10, 0.3), point(0.5, 14, 0.3), point(8, 14, 0.3),
                                          point(0.5, 14, 3),   point(0, -5, 0),     point(20, 10, 0),
                                          point(8, 120, 0)};
  SeenPoints open({}), walled({});
  walled.add(wall(10));
  EXPECT_EQ(numbers(open, points), (Numbers{0, 1, 2, 3}));
  EXPECT_EQ(numbers(walled, points), (Numbers{0, 2, 3}));
  picture_.T_enu_lens.translation = {0, 11, 0};
  EXPECT_EQ(numbers(walled, points), (Numbers{1}));
}

TEST_F(SeenPointsTest, WhatMovesHidesAtItsTime) {
  const std::vector<ColouredPoint> points{point(0.5, 14, 0.3)};
  SeenPoints there({}), later({});
  there.add(wall(10, 255, 0.03));
  later.add(wall(10, 255, 0.5));
  EXPECT_EQ(numbers(there, points), Numbers{});
  EXPECT_EQ(numbers(later, points), Numbers{0});
}

TEST_F(SeenPointsTest, ObservationsAreWhereTheLensShowsThem) {
  mount_.masks = {{{150, 0}, {199, 0}, {199, 159}, {150, 159}}};  // the vehicle, right of the pixel 150
  fusion::WorkerPool pool(1);
  const std::vector<LensPicture> lenses{LensPicture(mount_, LensPixels::Recorded)};
  const std::vector<ColouredPoint> points{point(6, 10, 0), point(2, 10, 1)};
  const auto seen = SeenPoints({}).find(points, std::vector{picture_}, lenses, pool);
  ASSERT_EQ(seen.at(0).size(), 1u);
  EXPECT_EQ(seen[0][0].point, 1u);
  EXPECT_NEAR(seen[0][0].u, 99.5 + 20, 1e-4);
  EXPECT_NEAR(seen[0][0].v, 79.5 - 10, 1e-4);
}

TEST_F(SeenPointsTest, TheOrderOfTheCloudDoesNotMatter) {
  SeenPoints::Config small;
  small.most_cells = 500;  // so cells become larger
  SeenPoints forwards(small), backwards(small);
  CloudBlock block = wall(10), far = wall(30);
  forwards.add(block);
  forwards.add(far);
  std::reverse(far.points.begin(), far.points.end());
  backwards.add(far);
  std::reverse(block.points.begin(), block.points.end());
  backwards.add(block);
  std::vector<ColouredPoint> points;
  for (int i = -60; i < 60; ++i) points.push_back(point(0.11 * i, 12 + 0.1 * i, 0.05 * i));
  const Numbers seen = numbers(forwards, points);
  EXPECT_EQ(numbers(backwards, points), seen);
  EXPECT_LT(seen.size(), points.size()) << "larger cells still hide";
}

TEST_F(SeenPointsTest, LeavesTheSamePointsOutInEachPicture) {
  SeenPoints::Config few;
  few.most_observations = 40;
  std::vector<ColouredPoint> points;
  for (int i = -50; i < 50; ++i) points.push_back(point(0.1 * i, 12, 0));
  fusion::WorkerPool pool(1);
  const std::vector<LensPicture> lenses{LensPicture(mount_, LensPixels::Recorded)};
  TakenPicture other = picture_;
  other.T_enu_lens.translation = {0.5, 0, 0};
  const auto seen = SeenPoints(few).find(points, std::vector{picture_, other}, lenses, pool);
  ASSERT_EQ(seen.size(), 2u);
  ASSERT_EQ(seen[0].size(), 20u);
  ASSERT_EQ(seen[1].size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(seen[0][i].point, seen[1][i].point);
}

}  // namespace
}  // namespace hueline::products
