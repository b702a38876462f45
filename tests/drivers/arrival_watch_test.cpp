#include "drivers/arrival_watch.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;

/// A device that sends each 10 ms by its own clock.
struct Watched {
  ArrivalWatch watch;
  std::vector<ArrivalWatch::Finding> found;
  void add(milliseconds passed, milliseconds waited) {
    if (const auto finding = watch.add(passed, waited)) found.push_back(*finding);
  }
  void send_on_time(int packets) {
    for (int i = 0; i < packets; ++i) add(milliseconds(10), milliseconds(10));
  }
};

TEST(ArrivalWatch, PacketsThatWereHeldBackAreNoStepOfTheClock) {
  Watched device;
  device.send_on_time(10);
  device.add(milliseconds(10), milliseconds(340));
  for (int i = 0; i < 32; ++i) device.add(milliseconds(10), milliseconds(0));
  device.send_on_time(500);
  ASSERT_EQ(device.found.size(), 1u);
  EXPECT_EQ(device.found[0].kind, FaultKind::Silent);
  EXPECT_EQ(device.found[0].moved, -milliseconds(330));
  EXPECT_EQ(device.found[0].words("its counter"),
            "a packet came 0.330 s later than its counter says: a network or a computer held it back");
}

TEST(ArrivalWatch, ABurstOfWhichABufferKeptOnlyTheEndIsNoStepEither) {
  Watched device;
  device.send_on_time(10);
  device.add(milliseconds(10), milliseconds(2000));
  device.add(milliseconds(1900), milliseconds(0));
  device.send_on_time(500);
  ASSERT_EQ(device.found.size(), 1u);
  EXPECT_EQ(device.found[0].kind, FaultKind::Silent);
}

TEST(ArrivalWatch, AClockThatGoesAheadOrBackHasJumped) {
  Watched device;
  device.send_on_time(10);
  device.add(milliseconds(510), milliseconds(10));
  device.send_on_time(10);
  device.add(-milliseconds(490), milliseconds(10));
  device.send_on_time(500);
  ASSERT_EQ(device.found.size(), 2u);
  EXPECT_EQ(device.found[0].kind, FaultKind::ClockStep);
  EXPECT_EQ(device.found[0].moved, milliseconds(500));
  EXPECT_EQ(device.found[1].kind, FaultKind::ClockStep);
  EXPECT_EQ(device.found[1].moved, -milliseconds(500));
  EXPECT_EQ(device.found[1].words("its clock"), "its clock moved -0.500000 s against the arrivals");
}

TEST(ArrivalWatch, AClockThatStaysBehindHasJumped) {
  Watched device;
  device.send_on_time(10);
  device.add(milliseconds(10), milliseconds(510));  // it stood still while nothing was sent
  device.send_on_time(500);
  ASSERT_EQ(device.found.size(), 2u);
  EXPECT_EQ(device.found[0].kind, FaultKind::Silent);
  EXPECT_EQ(device.found[1].kind, FaultKind::ClockStep);
  EXPECT_EQ(device.found[1].moved, -milliseconds(500));
}

TEST(ArrivalWatch, AClockThatGoesAheadInABurstHasJumped) {
  Watched device;
  device.add(milliseconds(10), milliseconds(510));
  device.add(milliseconds(1510), milliseconds(10));
  device.send_on_time(500);
  ASSERT_EQ(device.found.size(), 2u);
  EXPECT_EQ(device.found[1].kind, FaultKind::ClockStep);
  EXPECT_EQ(device.found[1].moved, milliseconds(1000));
}

TEST(ArrivalWatch, JitterAndLongOutagesAreNothing) {
  Watched device;
  for (int i = 0; i < 200; ++i) device.add(milliseconds(10), milliseconds(i % 2 == 0 ? 150 : -130));
  device.add(milliseconds(3'600'000), milliseconds(3'600'010));
  EXPECT_TRUE(device.found.empty());
}

}  // namespace
}  // namespace hueline::drivers
