#include "core/frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <concepts>
#include <random>

#include "core/angle.hpp"
#include "core/laser_time.hpp"

namespace hueline {
namespace {

template <class A, class B>
concept Multiplies = requires(A a, B b) {
  a* b;
};
static_assert(Multiplies<Transform<Enu, Body>, Transform<Body, Lens>>);
static_assert(!Multiplies<Transform<Body, Lens>, Transform<Enu, Body>>, "frames that do not meet must not compile");
static_assert(!Multiplies<Transform<Enu, Body>, Point<Enu>>);
template <class A, class B>
concept Subtracts = requires(A a, B b) {
  a - b;
};
static_assert(Subtracts<GpsTime, GpsTime>);
static_assert(!Subtracts<GpsTime, HostTime>, "instants of two clocks must not mix");
static_assert(!std::convertible_to<HostTime, GpsTime>);
static_assert(!Subtracts<UnixTime, GpsTime> && !std::convertible_to<UnixTime, GpsTime>);
static_assert(!Subtracts<LaserCounter, LaserCounter> && !Subtracts<LaserCounter, GpsTime>,
              "what a counter says is no instant");
static_assert(!std::convertible_to<LaserTime, GpsTime> && !std::constructible_from<GpsTime, LaserTime>);
static_assert(!std::convertible_to<HostTime, LaserTime> && !std::convertible_to<nanoseconds, LaserTime>);

Eigen::Vector3d forward_of(const Attitude& a) { return rotation_enu_body(a) * Eigen::Vector3d::UnitY(); }
Eigen::Vector3d right_of(const Attitude& a) { return rotation_enu_body(a) * Eigen::Vector3d::UnitX(); }

TEST(Attitude, AxisAlignedCasesByHand) {
  EXPECT_TRUE(forward_of({0, 0, 0}).isApprox(Eigen::Vector3d::UnitY())) << "heading 0 looks north";
  EXPECT_TRUE(forward_of({0, 0, 90 * kRadPerDeg}).isApprox(Eigen::Vector3d::UnitX())) << "heading 90 looks east";
  EXPECT_GT(forward_of({0, 10 * kRadPerDeg, 0}).z(), 0.17) << "pitch positive lifts the nose";
  EXPECT_LT(right_of({10 * kRadPerDeg, 0, 0}).z(), -0.17) << "roll positive lowers the right side";
}

TEST(Attitude, EqualsThePapersMatrix) {
  // papers, step 2: R(phi roll, omega pitch, kappa heading), IMU from local level.
  const double phi = 0.1, omega = -0.2, kappa = 2.5;
  const double sp = std::sin(phi), cp = std::cos(phi), so = std::sin(omega), co = std::cos(omega), sk = std::sin(kappa),
               ck = std::cos(kappa);
  Eigen::Matrix3d R_body_enu;
  R_body_enu << cp * ck + sp * so * sk, -cp * sk + sp * so * ck, -sp * co,  //
      co * sk, co * ck, so,                                                 //
      sp * ck - cp * so * sk, -sp * sk - cp * so * ck, cp * co;
  EXPECT_TRUE(rotation_enu_body({phi, omega, kappa}).toRotationMatrix().isApprox(R_body_enu.transpose(), 1e-14));
}

TEST(Attitude, RoundTrip) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> half(-1.5, 1.5), full(0, 6.28);
  for (int i = 0; i < 1000; ++i) {
    const Attitude a{2 * half(random), half(random), full(random)};
    const Attitude b = attitude_from_enu_body(rotation_enu_body(a));
    EXPECT_NEAR(a.roll, b.roll, 1e-9);
    EXPECT_NEAR(a.pitch, b.pitch, 1e-9);
    EXPECT_NEAR(a.heading, b.heading, 1e-9);
  }
}

TEST(Transform, InverseAndChain) {
  const Transform<Enu, Body> T_enu_body{rotation_enu_body({0.1, 0.2, 3.0}), {1, 2, 3}};
  const Transform<Body, Scanner> T_body_scanner{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 1, 0).normalized())), {0.5, 0, 1}};
  const Point<Scanner> p{{4, 5, 6}};
  EXPECT_TRUE(((T_enu_body * T_body_scanner) * p).xyz.isApprox((T_enu_body * (T_body_scanner * p)).xyz, 1e-14));
  EXPECT_TRUE(
      (T_enu_body.inverse() * (T_enu_body * Point<Body>{{7, 8, 9}})).xyz.isApprox(Eigen::Vector3d(7, 8, 9), 1e-14));
}

TEST(Attitude, HasAHeadingBelowAWholeTurn) {
  // A hair west of north.
  const Attitude a =
      attitude_from_enu_body(Eigen::Quaterniond(std::sqrt(1 - 1e-36), 0.0, 0.0, 1e-18) * rotation_enu_body({}));
  EXPECT_EQ(a.heading, 0.0);
}

}  // namespace
}  // namespace hueline
