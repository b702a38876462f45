// The time until a disk is full, against a disk whose end is known.
#include "runtime/disk_outlook.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hueline::runtime {
namespace {

TEST(DiskOutlook, ForeseesTheEndWithinAFewPercent) {
  // 61 MB/s of recording and products, written in bursts of up to 2 s, for an hour.
  constexpr double kRate = 61e6, kEnd_s = 3600;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> burst(0, 2 * kRate);
  DiskOutlook outlook;
  for (int at = 0; at < 3590; ++at) {
    const double free = kRate * (kEnd_s - at) - burst(random);
    outlook.note(at, static_cast<std::uint64_t>(std::max(0.0, free)));
    if (at < 20) {
      EXPECT_FALSE(outlook.fill());
    } else if (at > 120 && at < 3000) {
      EXPECT_NEAR(free / *outlook.fill(), kEnd_s - at, 0.05 * (kEnd_s - at)) << at;
    }
  }
}

TEST(DiskOutlook, FollowsAChangeOfTheRateWithinItsWindow) {
  DiskOutlook outlook;
  double free = 1e12;
  for (int at = 0; at < 600; ++at) {
    free -= at < 300 ? 20e6 : 80e6;
    outlook.note(at, static_cast<std::uint64_t>(free));
    if (at == 299) {
      EXPECT_NEAR(*outlook.fill(), 20e6, 1e5);
    }
  }
  EXPECT_NEAR(*outlook.fill(), 80e6, 1e5);
}

TEST(DiskOutlook, ARingThatMakesRoomFillsNoDisk) {
  DiskOutlook outlook;
  for (int at = 0; at < 600; ++at) outlook.note(at, static_cast<std::uint64_t>(5e9 - (at % 20) * 50e6));
  EXPECT_LT(*outlook.fill(), 1e6) << "50 MB/s are written, and 1 GB is removed every 20 s";
}

TEST(DiskOutlook, RoomThatIsMadeIsNoEnd) {
  DiskOutlook outlook;
  for (int at = 0; at < 100; ++at) outlook.note(at, at < 50 ? 1'000'000'000u : 90'000'000'000u);
  EXPECT_EQ(outlook.fill(), 0);
}

}  // namespace
}  // namespace hueline::runtime
