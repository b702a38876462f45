#include "fusion/depth_panorama.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "fusion/panorama_cells.hpp"
#include "fusion/worker_pool.hpp"

namespace hueline::fusion {
namespace {

using std::numbers::pi;
constexpr double kRad = pi / 180;

Eigen::Vector3f toward(double azimuth_deg, double elevation_deg, double distance) {
  const double a = azimuth_deg * kRad, e = elevation_deg * kRad;
  return (distance * Eigen::Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e))).cast<float>();
}
float nearness_at(const DepthPanorama& depth, float across, float down) {
  float nearness = 0;
  depth.nearness_of_row(std::span(&across, 1), down, &nearness);
  return nearness;
}
/// The distance in a direction; azimuths anticlockwise from the middle, as the axes are.
double distance_at(const DepthPanorama& depth, double azimuth_deg, double elevation_deg) {
  const double across = 0.5 - azimuth_deg / 360;
  return 1 / nearness_at(depth, static_cast<float>(across - std::floor(across)),
                         static_cast<float>((90 - elevation_deg) / 180));
}

TEST(DepthPanorama, TakesTheUnknownDistanceWhereNothingWasMeasured) {
  WorkerPool pool(1);
  DepthPanorama depth({.width = 256, .unknown_m = 12});
  depth.close(pool);
  EXPECT_EQ(depth.known_share(), 0);
  for (const double azimuth : {-179.0, 0.0, 90.0})
    for (const double elevation : {-89.0, 0.0, 60.0}) EXPECT_NEAR(distance_at(depth, azimuth, elevation), 12, 1e-3);
}

TEST(DepthPanorama, KnowsWhereTheAxesPoint) {
  WorkerPool pool(1);
  DepthPanorama depth({.width = 512});
  const std::vector<std::array<double, 3>> things{{0, 0, 5}, {90, 0, 6}, {-90, 0, 7}, {180, 0, 8}, {30, 60, 9}};
  std::vector<Eigen::Vector3f> points;
  for (const auto& [azimuth, elevation, distance] : things)
    for (double across = -3; across <= 3; across += 0.5)
      for (double up = -3; up <= 3; up += 0.5) points.push_back(toward(azimuth + across, elevation + up, distance));
  depth.add(points, pool);
  depth.close(pool);
  for (const auto& [azimuth, elevation, distance] : things)
    EXPECT_NEAR(distance_at(depth, azimuth, elevation), distance, 0.001);
}

TEST(DepthPanorama, CellsAreThoseOfTheAngles) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> along(-30, 30);
  constexpr std::uint32_t kWidth = 2048;
  constexpr double kPerRad = kWidth / (2 * pi);
  for (const std::size_t count : {0ul, 1ul, 15ul, 16ul, 20'003ul}) {
    std::vector<Eigen::Vector3f> points;
    for (std::size_t i = 0; i < count; ++i) points.emplace_back(along(random), along(random), along(random));
    PanoramaCells cells;
    find_cells(kWidth, points, cells);
    ASSERT_EQ(cells.row.size(), count);
    std::size_t beside = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d p = points[i].cast<double>();
      const double across = std::hypot(p.x(), p.y()), row = std::atan2(across, p.z()) * kPerRad,
                   column = kWidth / 2.0 - std::atan2(p.y(), p.x()) * kPerRad;
      // A cell beside it only where the place is at the border of two.
      ASSERT_NEAR(cells.row[i] + 0.5, row, 0.501);
      ASSERT_NEAR(cells.column[i] + 0.5, column, 0.501);
      beside += cells.row[i] != static_cast<int>(row) || cells.column[i] != static_cast<int>(column);
      ASSERT_NEAR(cells.nearness[i] * p.norm(), 1, 1e-6);
      ASSERT_EQ(cells.reach[i], static_cast<int>(std::min(0.5 * p.norm() / across, kWidth / 8.0)));
    }
    EXPECT_LE(beside, count / 500);
  }
}

TEST(DepthPanorama, PointsThatAreTooNearOrNoNumbersHaveNoCell) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();
  const std::vector<Eigen::Vector3f> points{{0, 0, 0},          {0.03f, 0, 0.02f}, {kNone, 1, 1},
                                            {1, 1, kNone},      {kInfinite, 0, 0}, {0, -kInfinite, 1},
                                            {0, 0, -kInfinite}, {3e38f, 3e38f, 0}};
  PanoramaCells cells;
  find_cells(1024, points, cells);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(cells.nearness[i], 0) << i;
    EXPECT_EQ(cells.row[i], 0) << i;
    EXPECT_EQ(cells.column[i], 0) << i;
  }
  // The ends of the axes, where an angle is 0 or pi.
  const std::vector<Eigen::Vector3f> ends{{2, 0, 0}, {-2, 0, 0}, {0, 2, 0}, {0, -2, 0}, {0, 0, 2}, {0, 0, -2}};
  find_cells(1024, ends, cells);
  const std::vector<std::array<int, 2>> expected{{512, 256}, {0, 256}, {256, 256}, {768, 256}, {512, 0}, {512, 511}};
  for (std::size_t i = 0; i < ends.size(); ++i) {
    EXPECT_GE(cells.nearness[i], 0.4999f) << i;
    EXPECT_NEAR(cells.column[i], expected[i][0], 1) << i;
    EXPECT_NEAR(cells.row[i], expected[i][1], 1) << i;
  }
}

TEST(DepthPanorama, FillsBetweenThePointsOfASurfaceAndKeepsAPlanePlane) {
  // A wall 8 m ahead, seen by rings 2 degrees apart.
  std::vector<Eigen::Vector3f> points;
  for (double elevation = -20; elevation <= 20; elevation += 2)
    for (double azimuth = -40; azimuth <= 40; azimuth += 0.2)
      points.push_back(toward(azimuth, elevation, 8 / (std::cos(azimuth * kRad) * std::cos(elevation * kRad))));
  WorkerPool pool(2);
  DepthPanorama depth({.width = 1024});
  depth.add(points, pool);
  depth.close(pool);
  for (double elevation = -18.5; elevation <= 18; elevation += 0.7)
    for (double azimuth = -38; azimuth <= 38; azimuth += 1.3)
      EXPECT_NEAR(distance_at(depth, azimuth, elevation) * std::cos(azimuth * kRad) * std::cos(elevation * kRad), 8,
                  0.12)
          << azimuth << " " << elevation;
}

TEST(DepthPanorama, LetsNothingBehindShowThroughGapsAndKeepsOutlines) {
  // A thing 4 m away with points a degree apart, before a wall at 20 m with points everywhere.
  std::vector<Eigen::Vector3f> points;
  for (double azimuth = -40; azimuth <= 40; azimuth += 0.25)
    for (double elevation = -30; elevation <= 30; elevation += 0.25) points.push_back(toward(azimuth, elevation, 20));
  for (double azimuth = -10; azimuth <= 10; azimuth += 1)
    for (double elevation = -10; elevation <= 10; elevation += 1) points.push_back(toward(azimuth, elevation, 4));
  WorkerPool pool(1);
  DepthPanorama depth({.width = 1440, .gap = 0.012});
  depth.add(points, pool);
  depth.close(pool);
  for (double azimuth = -9.5; azimuth <= 9.5; azimuth += 0.3) EXPECT_NEAR(distance_at(depth, azimuth, 0.4), 4, 0.01);
  for (const double azimuth : {-12.0, -11.0, 11.0, 12.0}) EXPECT_NEAR(distance_at(depth, azimuth, 0.4), 20, 0.1);
}

TEST(DepthPanorama, DependsOnNeitherThreadsNorOrder) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 100'000; ++i)
    points.push_back(toward(i * 137.508, 80 * std::sin(i * 0.7), 3 + std::fmod(i * 0.618, 30)));
  WorkerPool one(1), three(3);
  DepthPanorama a({.width = 512}), b({.width = 512});
  a.add(points, one);
  a.close(one);
  b.add(std::vector(3, toward(0, 0, 1)), three);
  b.clear();
  b.add(std::vector(points.rbegin(), points.rend()), three);
  b.close(three);
  EXPECT_EQ(a.known_share(), b.known_share());
  for (float across = 0; across < 1; across += 0.0173f)
    for (float down = 0; down <= 1; down += 0.0317f)
      EXPECT_EQ(nearness_at(a, across, down), nearness_at(b, across, down));
}

}  // namespace
}  // namespace hueline::fusion
