#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <span>

#include <fmt/format.h>

#include "core/measurements.hpp"

namespace hueline::test {

/// Expects the same returns in the same order, to the last bit.
inline void expect_same(std::span<const LaserReturn> found, std::span<const LaserReturn> expected) {
  const auto text = [](const LaserReturn& r) {
    return fmt::format("({}, {}, {}) range {} azimuth {} time {} channel {} reflectivity {} return {}/{}", r.x, r.y,
                       r.z, r.range_m, r.azimuth, r.time_offset_ns, r.channel, r.reflectivity, r.return_number,
                       r.return_count);
  };
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    ASSERT_EQ(std::memcmp(&found[i], &expected[i], sizeof(LaserReturn)), 0)
        << "return " << i << ": " << text(found[i]) << "; expected " << text(expected[i]);
}

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
