#include "core/portable_math.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace hueline {
namespace {

/// Largest difference in units of the last place of the right value.
template <class Ours, class Right>
double largest_ulp(const std::vector<double>& arguments, Ours ours, Right right) {
  double largest = 0;
  for (const double x : arguments) {
    const long double wanted = right(static_cast<long double>(x));
    const auto rounded = static_cast<double>(wanted);
    if (rounded == 0 || !std::isfinite(rounded)) continue;
    const double unit = std::abs(std::nextafter(rounded, 2 * rounded) - rounded);
    const auto off = static_cast<double>(std::abs(static_cast<long double>(ours(x)) - wanted)) / unit;
    EXPECT_LE(off, 2.5) << x;
    largest = std::max(largest, off);
  }
  return largest;
}

std::vector<double> around(double scale, int count = 20'000) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> even(-1, 1), power(-40, 0);
  std::vector<double> out;
  for (int i = 0; i < count; ++i) {
    out.push_back(scale * even(random));
    out.push_back(scale * even(random) * std::exp2(power(random)));
  }
  return out;
}

std::vector<double> positive(double scale) {
  std::vector<double> out = around(scale);
  for (double& x : out) x = std::abs(x);
  return out;
}

// 80-bit arithmetic of the C library is the judge.
TEST(PortableMath, IsWithinTwoPlacesOfTheTruth) {
  using L = long double;
  for (const double scale : {1.0, 7.0, 1000.0, 1e6}) {
    largest_ulp(around(scale), portable::sin, [](L x) { return std::sin(x); });
    largest_ulp(around(scale), portable::cos, [](L x) { return std::cos(x); });
  }
  largest_ulp(around(1.5), portable::tan, [](L x) { return std::tan(x); });
  for (const double scale : {1.0, 10.0, 1e9}) {
    largest_ulp(around(scale), portable::atan, [](L x) { return std::atan(x); });
    largest_ulp(positive(scale), portable::log, [](L x) { return std::log(x); });
  }
  largest_ulp(around(1), portable::asin, [](L x) { return std::asin(x); });
  largest_ulp(around(1), portable::acos, [](L x) { return std::acos(x); });
  for (const double scale : {1.0, 700.0}) {
    largest_ulp(around(scale), portable::exp, [](L x) { return std::exp(x); });
    largest_ulp(around(scale), portable::sinh, [](L x) { return std::sinh(x); });
  }
}

TEST(PortableMath, TakesTwoArguments) {
  const std::vector<double> a = around(3, 5000), b = around(50, 5000);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double angle = std::atan2(a[i], b[i]);
    EXPECT_NEAR(portable::atan2(a[i], b[i]), angle, 5e-16 * std::max(std::abs(angle), 1e-300));
    EXPECT_NEAR(portable::hypot(a[i], b[i]), std::hypot(a[i], b[i]), 5e-16 * std::hypot(a[i], b[i]));
    EXPECT_NEAR(portable::hypot(a[i], b[i], 2.0), std::hypot(a[i], b[i], 2.0), 5e-16 * std::hypot(a[i], b[i], 2.0));
    const double power = std::pow(std::abs(a[i]), b[i] / 20);
    ASSERT_TRUE(std::isfinite(power));
    EXPECT_NEAR(portable::pow(std::abs(a[i]), b[i] / 20), power, 4e-14 * power) << a[i];
  }
}

TEST(PortableMath, KnowsTheEndsOfItsDomain) {
  constexpr double inf = std::numeric_limits<double>::infinity(), pi = std::numbers::pi;
  EXPECT_EQ(portable::sin(0.0), 0.0);
  EXPECT_EQ(portable::cos(0.0), 1.0);
  EXPECT_EQ(portable::atan(inf), pi / 2);
  EXPECT_EQ(portable::atan2(0, -1), pi);
  EXPECT_EQ(portable::atan2(-0.0, -1), -pi);
  EXPECT_EQ(portable::atan2(1, 0), pi / 2);
  EXPECT_EQ(portable::atan2(-1, 0), -pi / 2);
  EXPECT_EQ(portable::atan2(0, 0), 0);
  EXPECT_EQ(portable::asin(1), pi / 2);
  EXPECT_EQ(portable::acos(-1), pi);
  EXPECT_EQ(portable::exp(0), 1);
  EXPECT_EQ(portable::exp(1000), inf);
  EXPECT_EQ(portable::exp(-1000), 0);
  EXPECT_EQ(portable::log(1), 0);
  EXPECT_EQ(portable::log(0), -inf);
  EXPECT_EQ(portable::pow(0, 2.4), 0);
  for (const double wrong : {portable::sin(inf), portable::cos(std::nan("")), portable::asin(1.1), portable::log(-1),
                             portable::atan2(std::nan(""), 1), portable::exp(std::nan(""))})
    EXPECT_TRUE(std::isnan(wrong));
}

TEST(PortableMath, TurnsAsEigenDoes) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d axis = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const double angle = 3.1 * std::tanh(normal(random));
    const Eigen::Quaterniond turn = portable::rotation_about(axis, angle);
    EXPECT_LE((turn.coeffs() - Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)).coeffs()).norm(), 1e-15);
    EXPECT_LE((portable::rotation_vector(turn) - angle * axis).norm(), 2e-15 * (1 + std::abs(angle)));
  }
}

// The bits that every machine must give; written down once, by one of them.
TEST(PortableMath, GivesTheSameBitsEverywhere) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  const auto add = [&](double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x100000001b3ull;
  };
  for (int i = 1; i <= 20'000; ++i) {
    const double x = i * 0.000731, y = (i * 7919 % 20'011) * 0.00113 - 11;
    for (const double value : {portable::sin(x), portable::cos(y), portable::tan(y), portable::atan(y),
                               portable::sinh(y), portable::atan2(y, x), portable::asin(x / 15), portable::exp(y),
                               portable::log(x), portable::pow(x, y / 5), portable::hypot(x, y)})
      add(value);
  }
  EXPECT_EQ(hash, 2114542909282238548u);
}

}  // namespace
}  // namespace hueline
