// The disk of a failing computer: what it accepts, how long it takes, and what is left.
#include "sim/faults/faulty_disk.hpp"

#include <gtest/gtest.h>

#include <cerrno>

namespace hueline::sim {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

FaultLine line_of(FaultType type, double at_s, double for_s = 1, double strength = 0) {
  FaultLine line = FaultLine::usual(type, at_s, for_s);
  line.strength = strength;
  return line;
}

TEST(FaultyDisk, AHealthyOneTakesAllAtOnce) {
  FaultyDisk disk({line_of(FaultType::PacketLoss, 0, 100, 1)}, 1);
  disk.set_now(5);
  EXPECT_EQ(disk.append(1'000'000'000), 1'000'000'000);
  EXPECT_EQ(disk.sync(), 0);
  EXPECT_EQ(disk.now_ns(), 5);
  EXPECT_EQ(disk.remains().size, 1'000'000'000u);
}

TEST(FaultyDisk, ASlowOneMakesSyncsWaitForItsRate) {
  FaultyDisk disk({line_of(FaultType::DiskSlow, 10, 4, 2)}, 1);
  disk.set_now(9 * kSecond);
  disk.append(50'000'000);
  disk.set_now(10 * kSecond);
  EXPECT_EQ(disk.append(3'000'000), 3'000'000) << "the kernel's memory takes it";
  EXPECT_EQ(disk.now_ns(), 10 * kSecond);
  EXPECT_EQ(disk.sync(), 0);
  EXPECT_EQ(disk.now_ns(), 10 * kSecond + kSecond * 3 / 2) << "3 MB at 2 MB/s; what came before is there";
  disk.append(1'000'000'000);
  EXPECT_EQ(disk.sync(), 0);
  EXPECT_EQ(disk.now_ns(), 14 * kSecond) << "then it is well again";
}

TEST(FaultyDisk, AHangingOneMakesSyncsWaitForItsEnd) {
  FaultyDisk disk({line_of(FaultType::DiskSlow, 10, 4, 0), line_of(FaultType::DiskSlow, 12, 1, 5)}, 1);
  disk.set_now(11 * kSecond);
  disk.append(1);
  EXPECT_EQ(disk.sync(), 0);
  EXPECT_EQ(disk.now_ns(), 14 * kSecond) << "of two lines the slower one holds";
}

TEST(FaultyDisk, AFullOneTakesWhatItHasRoomForAndMoreWhenThereIsRoomAgain) {
  FaultyDisk disk({line_of(FaultType::DiskFull, 10, 4, 1)}, 1);
  disk.set_now(0);
  EXPECT_EQ(disk.append(5'000'000), 5'000'000);
  disk.set_now(10 * kSecond);
  EXPECT_EQ(disk.append(900'000), 900'000);
  EXPECT_EQ(disk.append(900'000), 100'000) << "a short write, as the kernel does it";
  EXPECT_EQ(disk.append(1), -ENOSPC);
  EXPECT_EQ(disk.truncate(5'900'000), 0);
  EXPECT_EQ(disk.append(200'000), 100'000);
  EXPECT_EQ(disk.sync(), 0);
  disk.set_now(14 * kSecond);
  EXPECT_EQ(disk.append(900'000), 900'000);
}

TEST(FaultyDisk, AReadOnlyOneLosesWhatWaited) {
  FaultyDisk disk({line_of(FaultType::DiskReadOnly, 10)}, 7);
  disk.set_now(0);
  disk.append(1'000'000);
  EXPECT_EQ(disk.sync(), 0);
  disk.append(1'000'000);
  disk.set_now(100 * kSecond);
  EXPECT_EQ(disk.append(1), -EROFS);
  EXPECT_EQ(disk.sync(), -EIO);
  EXPECT_EQ(disk.sync(), -EROFS);
  EXPECT_EQ(disk.truncate(0), -EROFS);
  EXPECT_GE(disk.remains().size, 1'000'000u);
  EXPECT_GT(disk.remains().zeros.size(), 10u);
}

TEST(FaultyDisk, AKilledProgramLosesNothingThatItWrote) {
  FaultyDisk disk({line_of(FaultType::ProcessKill, 10), line_of(FaultType::PowerCut, 11)}, 1);
  EXPECT_EQ(disk.death(), FaultyDisk::Death::ProcessKill) << "the first ends it";
  disk.set_now(9 * kSecond);
  disk.append(1'234'567);
  EXPECT_FALSE(disk.is_dead());
  disk.set_now(10 * kSecond);
  EXPECT_TRUE(disk.is_dead());
  EXPECT_EQ(disk.append(1), -EIO);
  EXPECT_EQ(disk.remains().size, 1'234'567u);
  EXPECT_TRUE(disk.remains().zeros.empty());
}

TEST(FaultyDisk, APowerCutKeepsWhatWasSyncedAndSomePagesOfTheRest) {
  constexpr std::uint64_t kSynced = 1'000'001, kRest = 4'000'000;
  bool differ = false;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    FaultyDisk disk({line_of(FaultType::PowerCut, 10)}, seed), again({line_of(FaultType::PowerCut, 10)}, seed);
    for (FaultyDisk* one : {&disk, &again}) {
      one->set_now(0);
      one->append(kSynced);
      EXPECT_EQ(one->sync(), 0);
      one->append(kRest);
      one->set_now(10 * kSecond);
    }
    const auto remains = disk.remains(), same = again.remains();
    ASSERT_EQ(remains.zeros.size(), same.zeros.size());
    EXPECT_EQ(remains.size, same.size);
    EXPECT_GT(remains.size, kSynced);
    EXPECT_LE(remains.size, kSynced + kRest);
    std::uint64_t end = kSynced, lost = 0, torn = 0;
    for (const auto& range : remains.zeros) {
      EXPECT_GE(range.begin, end) << "what was synced is untouched, and ranges rise";
      EXPECT_LT(range.begin, range.end);
      EXPECT_LE(range.end, remains.size);
      end = range.end;
      lost += range.end - range.begin;
      torn += range.begin % 4096 != 0;
    }
    EXPECT_NEAR(static_cast<double>(lost), 0.46 * kRest,
                0.06 * kRest);  // four tenths of the pages, and a tenth of the bytes of the others
    EXPECT_GT(torn, 50u);
    if (seed > 1) differ |= remains.zeros.front().begin != kSynced;
  }
  EXPECT_TRUE(differ);
}

TEST(FaultyDisk, ASyncThatThePowerCutsOffPromisesNothing) {
  FaultyDisk disk({line_of(FaultType::DiskSlow, 9, 5, 1), line_of(FaultType::PowerCut, 10)}, 1);
  disk.set_now(9 * kSecond);
  disk.append(2'000'000);
  EXPECT_EQ(disk.sync(), -EIO);
  EXPECT_TRUE(disk.is_dead());
  EXPECT_EQ(disk.now_ns(), 10 * kSecond);
  EXPECT_GT(disk.remains().zeros.size(), 10u);
}

}  // namespace
}  // namespace hueline::sim
