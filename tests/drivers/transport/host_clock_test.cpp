#include "drivers/transport/host_clock.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace hueline::drivers {
namespace {

std::timespec read(clockid_t id) {
  std::timespec t{};
  clock_gettime(id, &t);
  return t;
}

class HostClock : public testing::TestWithParam<KernelClock> {};

TEST_P(HostClock, AStampMadeNowConvertsIntoTheBracketOfTwoHostReadings) {
  const clockid_t id = GetParam() == KernelClock::Realtime ? CLOCK_REALTIME : CLOCK_MONOTONIC;
  for (int i = 0; i < 200; ++i) {
    const HostTime before = host_now();
    const std::timespec stamp = read(id);
    const HostTime after = host_now();
    const ClockOffset offset = sample_clock_offset(GetParam());
    const HostTime converted = to_host_time(to_nanoseconds(stamp), offset);
    // The only tolerance is the window of the sampled pair, and slewing (500 ppm) over the few microseconds between.
    const nanoseconds slack = offset.half_window + nanoseconds(100) + (host_now() - before) / 1000;
    EXPECT_GE(converted, before - slack);
    EXPECT_LE(converted, after + slack);
  }
}

TEST_P(HostClock, DistancesBetweenStampsAreKept) {
  const ClockOffset offset = sample_clock_offset(GetParam());
  const nanoseconds stamp(1'700'000'000'123'456'789);
  EXPECT_EQ(to_host_time(stamp + nanoseconds(1), offset) - to_host_time(stamp, offset), nanoseconds(1));
}

INSTANTIATE_TEST_SUITE_P(Clocks, HostClock, testing::Values(KernelClock::Realtime, KernelClock::Monotonic),
                         [](const auto& test) {
                           return test.param == KernelClock::Realtime ? "Realtime" : "Monotonic";
                         });

TEST(HostClock, TimespecKeepsEveryNanosecond) {
  std::timespec t{};
  t.tv_sec = 1'700'000'000;
  t.tv_nsec = 999'999'999;
  EXPECT_EQ(to_nanoseconds(t).count(), 1'700'000'000'999'999'999);
}

}  // namespace
}  // namespace hueline::drivers
