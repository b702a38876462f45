#include "runtime/fault_rate.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

namespace hueline::runtime {
namespace {

using namespace std::chrono_literals;
constexpr SensorId kPos = 1, kPps = 2;

Fault fault(SensorId sensor, FaultKind kind, HostTime time, std::uint64_t count, std::string detail) {
  return {sensor, kind, time, count, std::move(detail)};
}
std::uint64_t sum(const std::vector<Fault>& faults) {
  std::uint64_t count = 0;
  for (const Fault& one : faults) count += one.count;
  return count;
}

TEST(FaultRate, ARunIsToldAtOnceAndThenOnceASecondWithItsCount) {
  FaultRate rate;
  std::vector<Fault> told;
  const auto take = [&] {
    for (Fault& one : rate.take()) told.push_back(std::move(one));
  };
  for (int i = 0; i < 40'000; ++i) {  // 8 s
    const HostTime now = host_time_ns(i * 200'000ll);
    rate.add(fault(kPos, FaultKind::Malformed, now, 3, fmt::format("{} bytes skipped, first #{}", i, i % 100)), now);
    take();
    if (i == 0) {
      EXPECT_EQ(told.size(), 1u) << "at once";
    }
  }
  EXPECT_EQ(told.size(), 8u);
  rate.flush();
  take();
  EXPECT_EQ(told.size(), 9u);
  EXPECT_EQ(sum(told), 120'000u);
  EXPECT_EQ(told.back().detail, "39999 bytes skipped, first #99") << "the newest";
}

TEST(FaultRate, WhatIsHeldIsToldWhenItsIntervalEndsThoughNothingFollows) {
  FaultRate rate;
  rate.add(fault(kPos, FaultKind::Lost, host_time_ns(0), 1, "a"), host_time_ns(0));
  rate.add(fault(kPos, FaultKind::Lost, host_time_ns(1), 2, "a"), host_time_ns(1));
  EXPECT_EQ(rate.take().size(), 1u);
  rate.advance(HostTime(999ms));
  EXPECT_TRUE(rate.take().empty());
  rate.advance(HostTime(1s));
  EXPECT_EQ(sum(rate.take()), 2u);
  rate.flush();
  EXPECT_TRUE(rate.take().empty());
}

TEST(FaultRate, DifferentTroublesDoNotHideEachOther) {
  FaultRate rate;
  const HostTime now{};
  rate.add(fault(kPos, FaultKind::Malformed, now, 1, "check sum 12 wrong"), now);
  rate.add(fault(kPos, FaultKind::Malformed, now, 1, "header too short"), now);
  rate.add(fault(kPos, FaultKind::Lost, now, 1, "header too short"), now);
  rate.add(fault(kPps, FaultKind::Lost, now, 1, "header too short"), now);
  rate.add(fault(kPos, FaultKind::Malformed, now, 1, "check sum 13 wrong"), now);
  EXPECT_EQ(rate.take().size(), 4u);
}

TEST(FaultRate, TextThatADeviceChoosesIsHeldToTheRateToo) {
  FaultRate rate;
  std::mt19937 random(1);
  std::vector<Fault> told;
  for (int i = 0; i < 20'000; ++i) {  // 10 s
    std::string text = "the receiver answered ";
    for (int k = 0; k < 12; ++k) text += static_cast<char>('a' + random() % 26);
    const HostTime now = host_time_ns(i * 500'000ll);
    rate.add(fault(kPos, FaultKind::Refused, now, 1, text), now);
    for (Fault& one : rate.take()) told.push_back(std::move(one));
  }
  rate.flush();
  for (Fault& one : rate.take()) told.push_back(std::move(one));
  EXPECT_EQ(sum(told), 20'000u);
  EXPECT_LE(told.size(), 12 * (FaultRate::kTroubles + 1));
}

TEST(FaultRate, WhatCouldNotBeToldIsNotForgotten) {
  FaultRate rate;
  rate.add(fault(kPos, FaultKind::Overflow, host_time_ns(0), 5, "a"), host_time_ns(0));
  for (Fault& one : rate.take()) rate.take_back(std::move(one));
  rate.add(fault(kPos, FaultKind::Overflow, host_time_ns(1), 2, "a"), host_time_ns(1));
  rate.advance(HostTime(2s));
  EXPECT_EQ(sum(rate.take()), 7u);
}

}  // namespace
}  // namespace hueline::runtime
