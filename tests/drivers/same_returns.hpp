#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/measurements.hpp"

namespace hueline::test {

inline std::string text_of(const LaserReturn& r) {
  return fmt::format("({}, {}, {}) range {} azimuth {} time {} channel {} reflectivity {} return {}/{}", r.x, r.y, r.z,
                     r.range_m, r.azimuth, r.time_offset_ns, r.channel, r.reflectivity, r.return_number,
                     r.return_count);
}

/// Expects the same returns in the same order, to the last bit.
inline void expect_same(std::span<const LaserReturn> found, std::span<const LaserReturn> expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    ASSERT_EQ(std::memcmp(&found[i], &expected[i], sizeof(LaserReturn)), 0)
        << "return " << i << ": " << text_of(found[i]) << "; expected " << text_of(expected[i]);
}

/// Expects the same returns in the same order, but for azimuths, which may differ by 1e-6 rad and have to be within a
/// turn, and for what a place across the scanner's axis may differ by, as a share of the range.
inline void expect_close(std::span<const LaserReturn> found, std::vector<LaserReturn> expected, double share = 0) {
  constexpr double kTurn = 2 * std::numbers::pi;
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto& one = found[i];
    auto& other = expected[i];
    ASSERT_LE(std::abs(std::remainder(double{one.azimuth} - double{other.azimuth}, kTurn)), 1e-6) << text_of(one);
    ASSERT_TRUE(one.azimuth >= 0 && one.azimuth < kTurn) << text_of(one);
    ASSERT_NEAR(one.x, other.x, share * other.range_m) << text_of(one);
    ASSERT_NEAR(one.y, other.y, share * other.range_m) << text_of(one);
    other.azimuth = one.azimuth, other.x = one.x, other.y = one.y;
  }
  expect_same(found, expected);
}

/// Expects that several runs make the same returns, to the last bit.
class SameAlways {
 public:
  void begin() { at_ = 0; }  ///< of a run
  void add(std::span<const LaserReturn> returns) {
    if (at_ == first_.size()) first_.emplace_back(returns.begin(), returns.end());
    expect_same(returns, first_[at_++]);
  }

 private:
  std::vector<std::vector<LaserReturn>> first_;
  std::size_t at_ = 0;
};

/// Random numbers that are the same on every machine, as those of the standard library's distributions are not.
class RandomPackets {
 public:
  explicit RandomPackets(unsigned seed) : random_(seed) {}
  /// Returns a number of 0 to `count` - 1.
  unsigned below(unsigned count) { return static_cast<unsigned>(random_() % count); }
  bool one_in(unsigned count) { return below(count) == 0; }
  /// Returns a distance as it may be beside `other`, the one before or that of the same firing: none, the same, the
  /// largest, one of the nearest, or any.
  unsigned distance(unsigned other) {
    switch (below(8)) {
      case 0:
      case 1:
        return 0;
      case 2:
        return other;
      case 3:
        return one_in(2) ? 0xFFFF : 1 + below(400);
      default:
        return below(0x10000);
    }
  }

 private:
  std::mt19937 random_;
};

}  // namespace hueline::test
