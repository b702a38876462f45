#include "fusion/object_measurement.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace hueline::fusion {
namespace {
using ::testing::HasSubstr;

/// Makes a wall ahead (north of the lens), turned by `oblique` about the vertical, with a return every 3 cm and 1 cm of
/// noise.
std::vector<SurfacePoint> wall(double distance_m, double oblique_deg, double west_m, double east_m, unsigned seed,
                               double noise_m = 0.01) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_m);
  std::uniform_real_distribution<double> uniform(-0.015, 0.015);
  const Eigen::AngleAxisd turn(oblique_deg * 3.14159265358979 / 180, Eigen::Vector3d::UnitZ());
  std::vector<SurfacePoint> out;
  for (double e = west_m; e <= east_m; e += 0.03)
    for (double u = -0.6; u <= 0.6; u += 0.03)
      out.push_back({Eigen::Vector3d(0, distance_m, 0) +
                         turn * Eigen::Vector3d(e + uniform(random), noise(random), u + uniform(random)),
                     Eigen::Vector3d(0.3, -0.5, 0), 0, 1.5f});
  return out;
}

TEST(ObjectMeasurement, FindsWhereTheRayMeetsAnObliqueWall) {
  const PickedRay ray{{0, 0, 0}, Eigen::Vector3d(0.01, 1, -0.02).normalized(), 5e-4};
  // Truth: y = 10 - x tan(-50 deg) ... solved on the plane itself.
  const Eigen::Vector3d normal =
      Eigen::AngleAxisd(50 * 3.14159265358979 / 180, Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitY();
  const Eigen::Vector3d truth = ray.direction_enu * (10 * normal.y() / ray.direction_enu.dot(normal));
  double square = 0, stated = 0;
  constexpr int kRuns = 40;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const auto found = measure_object(ray, wall(10, 50, -1, 1, seed), {});
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_NEAR(found->oblique_deg, 50, 15);
    EXPECT_NEAR(found->seconds, 1.5, 1e-6);
    square += (found->p_enu - truth).squaredNorm() / kRuns;
    stated += (found->covariance.trace() - 2 * std::pow(5e-4 * 10, 2) -
               std::pow(5e-4 * 10 * std::tan(50 * 3.14159265358979 / 180), 2)) /
              kRuns;
  }
  // If the ray has no error, only the wall's error remains, and it agrees with the stated sigma.
  EXPECT_LT(std::sqrt(square), 0.01);
  EXPECT_NEAR(std::sqrt(square / stated), 1, 0.3);
}

TEST(ObjectMeasurement, StatesWhatThePixelLeavesOpen) {
  const PickedRay ray{{0, 0, 0}, Eigen::Vector3d::UnitY(), 1e-3};
  const auto found = measure_object(ray, wall(10, 0, -1, 1, 1), {});
  ASSERT_TRUE(found.ok());
  EXPECT_NEAR(std::sqrt(found->covariance(0, 0)), 0.01, 0.001);  // east and up: 10 m x 1 mrad
  EXPECT_NEAR(std::sqrt(found->covariance(2, 2)), 0.01, 0.001);
  EXPECT_LT(std::sqrt(found->covariance(1, 1)), 0.007);  // along the ray: the wall's own error
}

TEST(ObjectMeasurement, TakesTheNearerOfTwoThingsOnOneRay) {
  auto points = wall(14, 0, -1, 1, 1);
  for (auto& point : points) point.from_enu.x() = -5;  // the scanner saw past the post what is behind it
  const auto post = wall(8, 0, -0.15, 0.15, 2);
  points.insert(points.end(), post.begin(), post.end());
  const auto on_post = measure_object({{0, 0, 0}, Eigen::Vector3d::UnitY(), 5e-4}, points, {});
  ASSERT_TRUE(on_post.ok()) << on_post.error().message;
  EXPECT_NEAR(on_post->distance_m, 8, 0.02);
  const auto beside = measure_object({{0, 0, 0}, Eigen::Vector3d(0.035, 1, 0).normalized(), 5e-4}, points, {});
  ASSERT_TRUE(beside.ok()) << beside.error().message;
  EXPECT_NEAR(beside->p_enu.y(), 14, 0.02);
}

TEST(ObjectMeasurement, LooksThroughWhatStoodThereAtOtherTimes) {
  // The side of a car that passes 5 m ahead. Before and after, the wall behind it was scanned from the same place.
  auto points = wall(9, 0, -1, 1, 1);
  const auto car = wall(5, 0, -1, 1, 2);
  points.insert(points.end(), car.begin(), car.end());
  const PickedRay ray{{0, 0, 0}, Eigen::Vector3d::UnitY(), 5e-4};
  const auto found = measure_object(ray, points, {});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_NEAR(found->distance_m, 9, 0.02);
  // The same board as a thing that stays: the scanner saw past its side what is behind it.
  for (std::size_t i = 0; i < points.size() - car.size(); ++i) points[i].from_enu.x() = -9;
  const auto stays = measure_object(ray, points, {});
  ASSERT_TRUE(stays.ok()) << stays.error().message;
  EXPECT_NEAR(stays->distance_m, 5, 0.02);
}

TEST(ObjectMeasurement, RefusesWithAReasonWhatCannotBeMeasured) {
  const PickedRay ray{{0, 0, 0}, Eigen::Vector3d::UnitY(), 1e-3};
  const auto reason = [&](const PickedRay& at, const std::vector<SurfacePoint>& points) {
    const auto found = measure_object(at, points, {});
    return found.ok() ? std::string("measured") : found.error().message;
  };
  EXPECT_THAT(reason(ray, {}), HasSubstr("saw nothing"));
  EXPECT_THAT(reason(ray, wall(10, 0, 0.1, 1, 1)), HasSubstr("no object has points all around"));
  auto points = wall(14, 0, -1, 1, 1);
  for (auto& point : points) point.from_enu.x() = -5;  // the scanner saw past the post what is behind it
  const auto post = wall(8, 0, -0.15, 0.15, 2);
  points.insert(points.end(), post.begin(), post.end());
  EXPECT_THAT(reason({{0, 0, 0}, Eigen::Vector3d(0.0215, 1, 0).normalized(), 1e-3}, points),
              HasSubstr("an edge: something at 8.0 m and something at 14.0 m"));
  EXPECT_THAT(reason(ray, wall(10, 0, -1, 1, 1, 0.3)), HasSubstr("deep (leaves"));
  EXPECT_THAT(reason(ray, wall(10, 0, -1, 1, 1, 0.06)), HasSubstr("scatter by 0.0"));
  // Behind the lens there is nothing.
  EXPECT_THAT(reason({{0, 0, 0}, -Eigen::Vector3d::UnitY(), 1e-3}, wall(10, 0, -1, 1, 1)), HasSubstr("saw nothing"));
}

TEST(ObjectMeasurement, SettingsOutOfRangeAreNamed) {
  EXPECT_EQ(ObjectMeasurementConfig{}.validate(), "");
  EXPECT_THAT((ObjectMeasurementConfig{.surface_points = 3}).validate(), HasSubstr("surface_points is 3"));
}

}  // namespace
}  // namespace hueline::fusion
