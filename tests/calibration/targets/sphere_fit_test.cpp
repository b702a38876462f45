#include "calibration/targets/sphere_fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

namespace hueline::calibration {
namespace {

/// Returns hits on the scanner's side of a sphere. Beams are spread evenly over its disc, with noise along and across
/// the beam.
std::vector<Eigen::Vector3f> hits(const Eigen::Vector3d& centre, double radius, std::size_t count,
                                  const ScannerNoise& noise, std::mt19937& random) {
  std::uniform_real_distribution<double> even(-1, 1);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d sight = centre.normalized(), right = sight.unitOrthogonal(), up = sight.cross(right);
  std::vector<Eigen::Vector3f> out;
  while (out.size() < count) {
    const double a = even(random), b = even(random);
    if (a * a + b * b >= 1) continue;
    const Eigen::Vector3d beam = (centre + radius * (a * right + b * up)).normalized();
    const double along = beam.dot(centre), inside = radius * radius - centre.squaredNorm() + along * along;
    if (inside < 0) continue;
    const double range = along - std::sqrt(inside) + noise.range_precision_m * normal(random);
    out.push_back(
        (range * (beam + noise.angle_rad * (normal(random) * right + normal(random) * up)).normalized()).cast<float>());
  }
  return out;
}

TEST(SphereFit, LinearFitMeetsAnExactSphere) {
  std::mt19937 random(1);
  const Eigen::Vector3d centre(60, -70, 12);
  const auto points = hits(centre, 0.145, 40, {1e-9, 1e-9, 0}, random);
  const auto fit = fit_linear(points);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->radius, 0.145, 2e-4);  // coordinates in float have steps of 4 um at 100 m
  EXPECT_LT((fit->centre_scanner - centre).norm(), 3e-4);
  EXPECT_GT(fit->roundness, 0.999);
}

TEST(SphereFit, RefusesPlanesAndThreePoints) {
  std::vector<Eigen::Vector3f> plane;
  for (int i = 0; i < 20; ++i)
    plane.emplace_back(50.f, 0.01f * static_cast<float>(i % 5), 0.01f * static_cast<float>(i / 5));
  EXPECT_FALSE(fit_linear(plane));
  EXPECT_FALSE(fit_linear(std::span(plane).first(3)));
  EXPECT_FALSE(fit_known_radius(std::span(plane).first(3), 0.1, {50.07, 0, 0}, {}));
}

// Compares the fit with known radius and the linear fit at a range where a target has few noisy points on one side, and
// the stated covariance with the errors.
TEST(SphereFit, KnownRadiusIsUnbiasedWithATrueCovariance) {
  std::mt19937 random(2);
  const ScannerNoise noise;
  const Eigen::Vector3d centre(90, 110, -9);
  const double radius = 0.0725;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), linear_mean = Eigen::Vector3d::Zero();
  double squared = 0, normalised = 0, linear_squared = 0;
  int runs = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto points = hits(centre, radius, 20, noise, random);
    const auto fit = fit_known_radius(points, radius, start_of_centre(points, radius), noise);
    const auto linear = fit_linear(points);
    ASSERT_TRUE(fit);
    ASSERT_TRUE(linear);
    const Eigen::Vector3d error = fit->centre_scanner - centre;
    mean += error;
    linear_mean += linear->centre_scanner - centre;
    squared += error.squaredNorm();
    linear_squared += (linear->centre_scanner - centre).squaredNorm();
    normalised += error.dot(fit->covariance.inverse() * error);
    ++runs;
  }
  mean /= runs;
  linear_mean /= runs;
  const double rms = std::sqrt(squared / runs), linear_rms = std::sqrt(linear_squared / runs);
  RecordProperty("known_radius_rms_mm", std::to_string(rms * 1e3));
  RecordProperty("linear_rms_mm", std::to_string(linear_rms * 1e3));
  std::printf(
      "20 points at 142 m: centre known radius %.2f mm rms, %.2f mm bias; linear %.2f mm rms, %.2f mm bias; normalised "
      "%.2f of 3\n",
      rms * 1e3, mean.norm() * 1e3, linear_rms * 1e3, linear_mean.norm() * 1e3, normalised / runs);
  EXPECT_LT(mean.norm(), 0.0003);
  EXPECT_LT(rms, linear_rms / 2);
  EXPECT_NEAR(normalised / runs, 3.0, 0.35);
}

}  // namespace
}  // namespace hueline::calibration
