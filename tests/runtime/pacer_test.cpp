#include "runtime/pacer.hpp"

#include <gtest/gtest.h>

namespace hueline::runtime {
namespace {

using std::chrono::seconds;

Packet packet_at(SensorId sensor, nanoseconds received) {
  Packet packet;
  packet.sensor = sensor;
  packet.received = HostTime(received);
  return packet;
}

TEST(DrivenTime, GoesWithTheStampsOfTheSensorsTogether) {
  DrivenTime driven(seconds(5));
  EXPECT_EQ(driven.of(packet_at(1, seconds(1000))), seconds(0));
  EXPECT_EQ(driven.of(packet_at(1, seconds(1001))), seconds(1));
  EXPECT_EQ(driven.of(packet_at(2, seconds(1001))), seconds(1));
  EXPECT_EQ(driven.of(packet_at(2, seconds(1003))), seconds(3));
  EXPECT_EQ(driven.of(packet_at(1, seconds(1002))), seconds(3));
  EXPECT_EQ(driven.of(packet_at(1, seconds(1004))), seconds(4));
}

/// A log whose pieces are counted from zero, beside a capture file that is stamped since 1970.
TEST(DrivenTime, OfSensorsWithZerosOfTheirOwnIsThatOfTheLonger) {
  DrivenTime driven(seconds(5));
  nanoseconds last{0};
  for (int i = 0; i <= 100; ++i) {
    driven.of(packet_at(1, std::chrono::milliseconds(i)));
    last = driven.of(packet_at(2, seconds(1'686'739'481) + std::chrono::milliseconds(20 * i)));
  }
  EXPECT_EQ(last, seconds(2));
}

TEST(DrivenTime, PassesOverStepsOfAClock) {
  DrivenTime driven(seconds(5));
  driven.of(packet_at(1, seconds(10)));
  driven.of(packet_at(1, seconds(11)));
  EXPECT_EQ(driven.of(packet_at(1, seconds(100'000))), seconds(1));
  EXPECT_EQ(driven.of(packet_at(1, seconds(100'001))), seconds(2));
  EXPECT_EQ(driven.of(packet_at(1, seconds(20))), seconds(2));
  EXPECT_EQ(driven.of(packet_at(1, seconds(21))), seconds(3));
}

/// The wait for a packet is bounded by the drive before it, whatever its stamp is.
TEST(Pacer, DoesNotWaitForAWildStamp) {
  Pacer pacer(1);
  pacer.take(packet_at(1, seconds(10)));
  EXPECT_TRUE(pacer.is_due());
  pacer.take(packet_at(1, std::chrono::hours(1'000'000)));
  EXPECT_TRUE(pacer.is_due());
  pacer.take(packet_at(1, std::chrono::hours(1'000'000) + seconds(4)));
  EXPECT_FALSE(pacer.is_due());
  EXPECT_LE(pacer.wait(), std::chrono::milliseconds(200));
}

TEST(Pacer, WaitsWhilePausedAndGoesOnFromThere) {
  Pacer pacer(1);
  pacer.take(packet_at(1, seconds(100)));
  EXPECT_TRUE(pacer.is_due());
  pacer.set({1000, true});
  pacer.take(packet_at(1, seconds(101)));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(pacer.wait(), std::chrono::milliseconds(200));
  // The time in which it was paused is not made up for: only what follows is paced, from the packet that waited on.
  pacer.set({1, false});
  EXPECT_TRUE(pacer.is_due());
  pacer.take(packet_at(1, seconds(102)));
  EXPECT_FALSE(pacer.is_due());
  pacer.set({0, false});
  EXPECT_TRUE(pacer.is_due());
}

TEST(Pacer, NeitherWaitsNorPausesBeforeThePartThatIsShown) {
  Pacer pacer(1, seconds(20));
  pacer.set({1, true});
  for (int second = 100; second < 120; ++second) {
    pacer.take(packet_at(1, seconds(second)));
    EXPECT_TRUE(pacer.is_due()) << second;
  }
  pacer.take(packet_at(1, seconds(120)));
  EXPECT_FALSE(pacer.is_due());
  pacer.set({1, false});
  EXPECT_TRUE(pacer.is_due());
  pacer.take(packet_at(1, seconds(121)));
  EXPECT_FALSE(pacer.is_due());
}

}  // namespace
}  // namespace hueline::runtime
