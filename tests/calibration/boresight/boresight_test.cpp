#include "calibration/boresight/boresight.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/boresight/patches.hpp"
#include "core/angle.hpp"
#include "tests/calibration/boresight/simulated_passes.hpp"

namespace hueline::calibration::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Forty metres in both directions with few rays, so that all checks of a debug build take seconds.
PassesSetting small() {
  PassesSetting out;
  out.length_m = 40;
  out.speed = 5;
  out.rays_per_s = 2500;
  return out;
}
BoresightConfig coarse() {
  BoresightConfig out;
  out.most_patches = 300;
  out.most_of_patch = 30;
  out.knot_s = 2;
  return out;
}

TEST(Boresight, FindsRotationAndHorizontalLeverArmFromADegreeAndADecimetreOff) {
  PassesSetting setting = small();
  setting.off_lever_m = 0.1;
  BoresightConfig config = coarse();
  config.sigma_lever_m = 0.1;
  const auto passes = simulate_passes(setting);
  const auto found = find_boresight(passes.drive, config);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->is_settled);
  const ScannerBoresight& laser = found->scanners[0];
  const Eigen::VectorXd error = boresight_error(*found, passes);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(error[static_cast<Eigen::Index>(i)]), 3.5 * laser.sigma[i]) << i;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(laser.sigma[i], 0.03 * kRadPerDeg) << i;
  for (std::size_t i = 3; i < 5; ++i) EXPECT_LT(laser.sigma[i], 0.01) << i;
  EXPECT_NEAR(laser.boresight_rotation.norm(), 1 * kRadPerDeg, 0.1 * kRadPerDeg);
  EXPECT_NEAR(laser.unit_sigma, 1, 0.25);
}

TEST(Boresight, ErrorsAreWhatTheStatedCovarianceSays) {
  double squares = 0;
  int values = 0, beyond_three = 0;
  constexpr int kRuns = 4;
  for (int run = 0; run < kRuns; ++run) {
    PassesSetting setting = small();
    setting.seed = static_cast<std::uint32_t>(100 + run);
    const auto passes = simulate_passes(setting);
    const auto found = find_boresight(passes.drive, coarse());
    ASSERT_TRUE(found.ok()) << found.error().message;
    const Eigen::VectorXd error = boresight_error(*found, passes);
    squares += error.dot(found->covariance.llt().solve(error));
    for (Eigen::Index i = 0; i < 6; ++i, ++values)
      beyond_three += std::abs(error[i]) > 3 * std::sqrt(found->covariance(i, i));
  }
  // Chi-squared of 24 degrees of freedom is between 8 and 52 in 998 of 1000 cases.
  EXPECT_GT(squares, 8);
  EXPECT_LT(squares, 52);
  EXPECT_LE(beyond_three, 1) << "of " << values;
}

TEST(Boresight, MovingThingsAndLeavesDoNotBendIt) {
  PassesSetting setting = small();
  setting.outliers = 0.2;
  setting.seed = 3;
  const auto passes = simulate_passes(setting);
  const auto found = find_boresight(passes.drive, coarse());
  ASSERT_TRUE(found.ok()) << found.error().message;
  const Eigen::VectorXd error = boresight_error(*found, passes);
  for (Eigen::Index i = 0; i < 6; ++i) EXPECT_LT(std::abs(error[i]), 3.5 * std::sqrt(found->covariance(i, i))) << i;
}

TEST(Boresight, WhatTheDataDoNotDetermineStaysAsMeasuredAndIsSaid) {
  const auto passes = simulate_passes(small());
  const auto found = find_boresight(passes.drive, coarse());
  ASSERT_TRUE(found.ok()) << found.error().message;
  const ScannerBoresight& laser = found->scanners[0];
  EXPECT_THAT(laser.is_determined, ElementsAre(true, true, true, true, true, false));
  EXPECT_LT(laser.share[5], 0.5);
  EXPECT_GT(laser.share[3], 0.9);
  EXPECT_NEAR(laser.lever_moved_m.z(), 0, 1e-6);
  EXPECT_NEAR(laser.sigma[5], 0.02, 1e-6) << "it is as wrong as it was measured";
}

TEST(Boresight, TwoScannersShareTheirPlanes) {
  PassesSetting setting = small();
  setting.scanners = 2;
  setting.rays_per_s = 5000;
  const auto passes = simulate_passes(setting);
  const auto found = find_boresight(passes.drive, coarse());
  ASSERT_TRUE(found.ok()) << found.error().message;
  const Eigen::VectorXd error = boresight_error(*found, passes);
  for (Eigen::Index i = 0; i < 12; ++i) EXPECT_LT(std::abs(error[i]), 3.5 * std::sqrt(found->covariance(i, i))) << i;
  // Both scanners rotate with the same POS. Their rotation relative to each other is therefore known much better than
  // that relative to the body.
  const double apart = std::sqrt(found->covariance(2, 2) + found->covariance(8, 8) - 2 * found->covariance(2, 8));
  EXPECT_LT(apart, 0.3 * std::sqrt(found->covariance(2, 2)));
  EXPECT_LT(std::abs(error[2] - error[8]), 3.5 * apart);
}

TEST(Boresight, TheSameDriveGivesTheSameBytes) {
  PassesSetting setting = small();
  setting.rays_per_s = 2000;
  const auto once = find_boresight(simulate_passes(setting).drive, coarse()),
             again = find_boresight(simulate_passes(setting).drive, coarse());
  ASSERT_TRUE(once.ok() && again.ok());
  EXPECT_EQ(once->scanners[0].T_body_scanner.rotation.coeffs(), again->scanners[0].T_body_scanner.rotation.coeffs());
  EXPECT_EQ(once->covariance, again->covariance);
}

TEST(Boresight, RefusesWhatDoesNotFixARotation) {
  const auto refusal = [](const PassesSetting& setting) {
    const auto found = find_boresight(simulate_passes(setting).drive, coarse());
    return found.ok() ? std::string("found") : found.error().message;
  };
  PassesSetting once = small();
  once.comes_back = false;
  EXPECT_THAT(refusal(once), HasSubstr("one pass only"));
  PassesSetting plain = small();
  plain.has_houses = false;
  EXPECT_THAT(refusal(plain), HasSubstr("upward (heading)"));
  EXPECT_THAT(refusal(plain), HasSubstr("all planes face one direction"));
  PassesSetting moved = small();
  moved.outliers = 0.97;
  EXPECT_THAT(refusal(moved), HasSubstr("flat places"));
  PassesSetting far = small();
  far.off_deg = 9;
  EXPECT_THAT(refusal(far), testing::AnyOf(HasSubstr("farther than"), HasSubstr("flat places")));
  EXPECT_THAT(find_boresight({}, {}).error().message, HasSubstr("no laser scanner"));
  BoresightDrive empty;
  empty.scanners.push_back({"laser", {}, 0.02});
  EXPECT_THAT(find_boresight(empty, {}).error().message, HasSubstr("no laser return"));
  BoresightConfig wrong;
  wrong.sigma_lever_m = 0;
  EXPECT_THAT(find_boresight(empty, wrong).error().message, HasSubstr("sigma_lever_m is 0; allowed"));
}

TEST(ReturnStore, IsBoundedAndStillFindsIt) {
  PassesSetting setting = small();
  setting.rays_per_s = 6000;
  ReturnStore::Config store;
  store.most_returns = 20'000;
  const auto passes = simulate_passes(setting, store);
  EXPECT_LE(passes.drive.returns.size(), 25'000U);  // the last stretch is added to the limit
  EXPECT_GT(passes.drive.returns.size(), 8'000U);
  const auto found = find_boresight(passes.drive, coarse());
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_LT(boresight_error(*found, passes).head<3>().norm(), 0.08 * kRadPerDeg);
}

TEST(Passes, BeginAfterAGapOrATurn) {
  // Twenty metres each: forward, a turn at 60 m, and back.
  const std::vector<DriveStretch> drive = {{0, 0}, {20, 0.1}, {40, 0}, {60, 1.6}, {62, 3.0}, {80, 3.1}, {200, 3.1}};
  EXPECT_THAT(passes_of({0, 1, 2}, drive, {}), ElementsAre(0, 0, 0));
  EXPECT_THAT(passes_of({1, 2, 3, 4, 5}, drive, {}), ElementsAre(0, 0, 1, 2, 2));
  EXPECT_THAT(passes_of({2, 5}, drive, {}), ElementsAre(0, 1));
  EXPECT_THAT(passes_of({5, 6}, drive, {}), ElementsAre(0, 1)) << "the same track again, later";
}

}  // namespace
}  // namespace hueline::calibration::test
