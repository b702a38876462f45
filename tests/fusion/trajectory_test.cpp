#include "fusion/trajectory.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/fusion/drive.hpp"

namespace hueline::fusion {
namespace {
using namespace hueline::test;
using std::numbers::pi;

Trajectory filled(const Drive& drive, double from, double to, double rate, Trajectory::Config config = {}) {
  Trajectory trajectory(config);
  for (int i = 0; from + i / rate <= to; ++i) trajectory.add(drive.solution(from + i / rate));
  return trajectory;
}

TEST(Trajectory, At200HzFarBelowATenthOfAMillimetreAnd5Microradians) {
  for (const double shake : {1.0, 3.0}) {
    const Drive drive(Motion{.speed = 20, .turn_rate = 0.3, .shake = shake});
    const Trajectory trajectory = filled(drive, 0, 20, 200);  // up to 400 m from where it began
    double worst_position = 0, worst_angle = 0, worst_velocity = 0;
    for (double t = 0.02; t < 19.97; t += 0.00137) {
      const auto [pose, reason] = trajectory.pose_at(at(t));
      ASSERT_EQ(reason, NoPose::None);
      Matrix3 R;
      Vector3 p;
      drive.pose_in(*trajectory.origin(), t, R, p);
      worst_position = std::max(worst_position, (p - pose->T_enu_body.translation).norm());
      worst_angle = std::max(worst_angle,
                             Eigen::AngleAxisd(R.transpose() * pose->T_enu_body.rotation.toRotationMatrix()).angle());
      worst_velocity =
          std::max(worst_velocity, std::abs(pose->velocity_enu.norm() - drive.motion().velocity(t).norm()));
    }
    EXPECT_LT(worst_position, 1e-6);
    EXPECT_LT(worst_angle, 5e-7);
    EXPECT_LT(worst_velocity, 1e-3);
    std::printf("shake %.0f: worst %.2e m, %.2e rad\n", shake, worst_position, worst_angle);
  }
}

TEST(Trajectory, FarFromTheOriginTheLevelIsTilted) {
  // At 40 km from the origin, the reported attitudes refer to a level that is tilted by 6 mrad.
  const Drive drive(Motion{.speed = 2000, .turn_rate = 1e-4, .shake = 1.0});
  const Trajectory trajectory = filled(drive, 0, 20, 50);
  const double t = 19.513;
  Matrix3 R;
  Vector3 p;
  drive.pose_in(*trajectory.origin(), t, R, p);
  const auto pose = trajectory.pose_at(at(t)).pose;
  ASSERT_TRUE(pose);
  EXPECT_LT((p - pose->T_enu_body.translation).norm(), 1e-4);
  EXPECT_LT(Eigen::AngleAxisd(R.transpose() * pose->T_enu_body.rotation.toRotationMatrix()).angle(), 1e-5);
}

TEST(Trajectory, SaysWhyThereIsNoPose) {
  const Drive drive(Motion{});
  Trajectory trajectory{Trajectory::Config{}};
  EXPECT_EQ(trajectory.pose_at(at(0)).reason, NoPose::NoSolution);
  for (int i = 0; i <= 20; ++i) trajectory.add(drive.solution(i / 200.0));
  for (int i = 0; i < 60; ++i) {  // 0.3 s during which the receiver does not call its solution good
    InsSolution bad = drive.solution(0.105 + i / 200.0);
    bad.is_good = false;
    trajectory.add(bad);
  }
  for (int i = 0; i <= 20; ++i) trajectory.add(drive.solution(0.5 + i / 200.0));
  EXPECT_EQ(trajectory.pose_at(at(-0.001)).reason, NoPose::BeforeFirst);
  EXPECT_EQ(trajectory.pose_at(at(0.3)).reason, NoPose::Gap);
  EXPECT_EQ(trajectory.pose_at(at(0.601)).reason, NoPose::AfterLast);
  EXPECT_TRUE(trajectory.pose_at(at(0.1)).pose);
  EXPECT_TRUE(trajectory.pose_at(at(0.5)).pose);
  EXPECT_EQ(trajectory.counts().not_good, 60u);
  EXPECT_EQ(trajectory.counts().used, 42u);
  trajectory.add(drive.solution(0.55));
  InsSolution broken = drive.solution(0.7);
  broken.velocity_enu.x() = std::nan("");
  trajectory.add(broken);
  EXPECT_EQ(trajectory.counts().out_of_order, 1u);
  EXPECT_EQ(trajectory.counts().not_finite, 1u);
}

TEST(Trajectory, SigmaGrowsTowardsTheMiddleOfAGap) {
  const Drive drive(Motion{});
  Trajectory trajectory{Trajectory::Config{.max_gap = nanoseconds(2'000'000'000)}};
  for (const double t : {0.0, 0.005, 1.005, 1.010}) trajectory.add(drive.solution(t));
  const auto sigma = [&](double t) { return trajectory.pose_at(at(t)).pose->sigma_position.x(); };
  EXPECT_NEAR(sigma(0.0025), 0.01, 1e-5);
  EXPECT_NEAR(sigma(0.505), std::hypot(0.01, 1.0 / 8), 1e-3);  // a h^2 / 8 of an unknown 1 m/s^2
  EXPECT_GT(sigma(0.505), sigma(0.2));
  EXPECT_GT(sigma(0.2), sigma(0.05));
  EXPECT_GT(trajectory.pose_at(at(0.505)).pose->sigma_attitude.z(), 0.05);
}

/// Poses that were stamped when they arrived come two at once: the rate between them is their error over microseconds.
TEST(Trajectory, TwoSolutionsOfOneMomentMakeNoLeap) {
  const Drive drive(Motion{.speed = 5, .turn_rate = 0.3, .shake = 0});
  Trajectory trajectory({});
  for (int i = 0; i < 1000; ++i)
    for (const double late : {0.0, 5e-6}) {
      if (late > 0 && i % 5 != 0) continue;
      InsSolution solution = drive.solution(i * 0.01 + late);
      solution.sigma = {0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 5e-4, 5e-4, 5e-4};
      solution.attitude.heading += late > 0 ? 5e-4 : 0;
      trajectory.add(solution);
    }
  EXPECT_EQ(trajectory.counts().used, 1200u);
  EXPECT_EQ(trajectory.counts().leaps, 0u);
  EXPECT_LT(trajectory.pose_at(at(5.005)).pose->sigma_attitude.z(), 1e-3);
}

TEST(Trajectory, ALeapGrowsTheSigmaUntilItIsTakenBack) {
  for (const double shake : {1.0, 3.0}) {
    const Drive drive(Motion{.speed = 20, .turn_rate = 0.3, .shake = shake});
    Trajectory trajectory({});
    const auto add = [&](double from, double to, double up_m, double turned) {
      for (int i = 0; from + i * 0.01 < to - 1e-9; ++i) {
        InsSolution solution = drive.solution(from + i * 0.01);
        solution.sigma = {0.01, 0.01, 0.01, 0.01, 0.01, 0.01, 1e-4, 1e-4, 3e-4};
        solution.position.ellipsoidal_height += up_m;
        solution.attitude.heading += turned;
        trajectory.add(solution);
      }
    };
    add(0, 5, 0, 0);
    EXPECT_EQ(trajectory.counts().leaps, 0u);
    add(5, 8, 1.5, 0.02);
    EXPECT_EQ(trajectory.counts().leaps, 1u);
    EXPECT_NEAR(trajectory.leapt_m(), 1.5, 0.01);
    EXPECT_NEAR(trajectory.leapt_angle(), 0.02, 0.002);
    add(8, 10, 0, 0);
    EXPECT_EQ(trajectory.counts().leaps, 2u);
    const auto sigma = [&](double t) { return trajectory.pose_at(at(t)).pose->sigma_position.z(); };
    EXPECT_NEAR(sigma(4.5), 0.01, 1e-3);
    EXPECT_NEAR(sigma(6.5), 1.5, 0.02);
    EXPECT_NEAR(sigma(9.5), 0.01, 1e-3);
    EXPECT_GT(trajectory.pose_at(at(6.5)).pose->sigma_attitude.z(), 0.018);
    EXPECT_LT(trajectory.pose_at(at(9.5)).pose->sigma_attitude.z(), 1e-3);
  }
}

TEST(Trajectory, SigmaFromItsOwnMessageOrFromTheConfig) {
  const Drive drive(Motion{});
  Trajectory trajectory{Trajectory::Config{.sigma_position_m = 0.5}};
  InsSolution s = drive.solution(0);
  s.sigma.reset();
  trajectory.add(s);
  InsUncertainty u;
  u.sigma = {0.1, 0.2, 0.3, 0, 0, 0, 1e-3, 2e-3, 3e-3};
  trajectory.add(u);
  s = drive.solution(0.005);
  s.sigma.reset();
  trajectory.add(s);
  EXPECT_DOUBLE_EQ(trajectory.pose_at(at(0)).pose->sigma_position.z(), 0.5);
  EXPECT_DOUBLE_EQ(trajectory.pose_at(at(0.005)).pose->sigma_position.z(), 0.3);
  EXPECT_DOUBLE_EQ(trajectory.pose_at(at(0.005)).pose->sigma_attitude.z(), 3e-3);
}

TEST(Trajectory, OriginIsOnTheGridAndMemoryIsBounded) {
  const Drive drive(Motion{});
  Trajectory a{Trajectory::Config{}}, b{Trajectory::Config{.max_solutions = 16}};
  a.add(drive.solution(0.0));
  for (int i = 0; i < 400; ++i) b.add(drive.solution(0.3 + i / 200.0));
  EXPECT_EQ(a.origin()->latitude, b.origin()->latitude);  // two starts, 4 m apart
  EXPECT_EQ(a.origin()->longitude, b.origin()->longitude);
  EXPECT_NEAR(a.origin()->latitude * 180 / pi, 48.137, 1e-12);
  EXPECT_EQ(b.counts().crowded_out, 384u);
  EXPECT_EQ(b.pose_at(at(0.4)).reason, NoPose::BeforeFirst);

  Trajectory c = filled(drive, 0, 2, 200), d = filled(drive, 0, 2, 200);
  d.forget_before(at(1.0013));
  const auto before = c.pose_at(at(1.0013)).pose, after = d.pose_at(at(1.0013)).pose;
  EXPECT_EQ(before->T_enu_body.rotation.coeffs(), after->T_enu_body.rotation.coeffs());
  EXPECT_EQ(before->T_enu_body.translation, after->T_enu_body.translation);
  EXPECT_EQ(d.pose_at(at(0.9)).reason, NoPose::BeforeFirst);
}

TEST(Trajectory, SettledMeansThatNothingChangesAnyMore) {
  const Drive drive(Motion{.shake = 3});
  Trajectory trajectory = filled(drive, 0, 0.1, 200);
  EXPECT_TRUE(trajectory.is_settled(at(0.0949)));
  EXPECT_FALSE(trajectory.is_settled(at(0.0951)));
  const auto before = trajectory.pose_at(at(0.0949)).pose;
  trajectory.add(drive.solution(0.105));
  EXPECT_EQ(before->T_enu_body.rotation.coeffs(), trajectory.pose_at(at(0.0949)).pose->T_enu_body.rotation.coeffs());
}

}  // namespace
}  // namespace hueline::fusion
