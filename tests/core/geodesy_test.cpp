#include "core/geodesy.hpp"

#include <gtest/gtest.h>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/LocalCartesian.hpp>
#include <limits>
#include <numbers>
#include <random>

#include "core/angle.hpp"

namespace hueline {
namespace {

// A coordinate of 6.4e6 m has a spacing of 0.9 nm in double: 5 nm is a few roundings.

TEST(Geodesy, EqualsGeographicLib) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> lat(-90, 90), lon(-180, 180), h(-5000, 100000);
  const auto& earth = GeographicLib::Geocentric::WGS84();
  for (int i = 0; i < 5000; ++i) {
    const double B = i == 0 ? 90 : i == 1 ? -90 : lat(random), L = lon(random), H = h(random);
    double x, y, z;
    earth.Forward(B, L, H, x, y, z);
    const auto p = to_ecef({B * kRadPerDeg, L * kRadPerDeg, H});
    ASSERT_LT((p.xyz - Eigen::Vector3d(x, y, z)).norm(), 5e-9);
    const Geodetic back = to_geodetic(p);
    ASSERT_NEAR(back.ellipsoidal_height, H, 5e-9);
    ASSERT_LT((to_ecef(back).xyz - p.xyz).norm(), 5e-9) << B << " " << L << " " << H;
  }
}

TEST(Geodesy, LocalLevelEqualsGeographicLib) {
  const Geodetic origin{39.9 * kRadPerDeg, 116.3 * kRadPerDeg, 50};
  const GeographicLib::LocalCartesian local(39.9, 116.3, 50);
  const auto T_ecef_enu = ecef_from_enu(origin);
  double x, y, z;
  local.Forward(39.91, 116.28, 70, x, y, z);
  const Point<Enu> p = T_ecef_enu.inverse() * to_ecef({39.91 * kRadPerDeg, 116.28 * kRadPerDeg, 70});
  EXPECT_LT((p.xyz - Eigen::Vector3d(x, y, z)).norm(), 5e-9);
}

TEST(Geodesy, PlacesThatAreNone) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_TRUE(is_on_earth({kPi / 2, -kPi, 8848}));
  EXPECT_FALSE(is_on_earth({kPi / 2 + 1e-9, 0, 0}));
  EXPECT_FALSE(is_on_earth({0, -kPi - 1e-9, 0}));
  EXPECT_FALSE(is_on_earth({0, 0, 1e5}));
  EXPECT_FALSE(is_on_earth({std::numeric_limits<double>::quiet_NaN(), 0, 0}));
  EXPECT_FALSE(is_on_earth({0, 0, -2e10})) << "a receiver's word for a number that it does not know";
}

}  // namespace
}  // namespace hueline
