// The clocks of two computers, joined by the seconds of GPS time that both saw.
#include "sync/clock_relation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/sync/simulated_time.hpp"

namespace hueline::sync {
namespace {

using namespace hueline::test;
using testing::HasSubstr;

/// A computer that stamps the pulses of a drive of an hour.
struct Computer {
  Computer(std::uint64_t seed, Oscillator::Form form, HostTime booted)
      : clock(some_begin(), seconds(4000), form, seed, booted), random(seed + 77) {}

  std::vector<SecondSeen> seen(int from, int to, double jitter_us = 2,
                               const std::function<nanoseconds(int)>& shift = {}) {
    std::vector<SecondSeen> out;
    const std::int64_t first = count_ns(some_begin()) / 1'000'000'000 + 1;
    for (int i = from; i < to; ++i) {
      const HostTime at = clock.host(gps_time_ns((first + i) * 1'000'000'000)) + us(random.gauss(jitter_us));
      out.push_back({first + i, at + (shift ? shift(i) : nanoseconds(0)), nanoseconds(500)});
    }
    return out;
  }
  OtherTime other(GpsTime t) const { return OtherTime(clock.host(t).time_since_epoch()); }

  Oscillator clock;
  Random random;
};

constexpr Oscillator::Form kFirstForm{12, 0.05, 1, 0, 0, 900};
constexpr Oscillator::Form kOtherForm{-8, 0.05, 1, 0.05, 0.2, 900};

TEST(ClockRelation, AConstantDifferenceIsFoundToTheNanosecond) {
  const nanoseconds offset(7'200'000'012'345'678);
  Computer computer(1, kFirstForm, host_time_ns(1'000'000'000'000));
  const auto first = computer.seen(0, 600, 15);
  auto other = first;
  for (SecondSeen& one : other) one.at += offset;
  const auto relation = ClockRelation::fit(first, other);
  ASSERT_TRUE(relation.ok()) << relation.error().message;
  EXPECT_EQ(relation->rate(), 0);
  EXPECT_EQ(relation->left_out(), 0u);
  Random random(5);
  for (int i = 0; i < 10'000; ++i) {
    const HostTime t = first.front().at + us(random.uniform(-1e8, 1e9));
    EXPECT_EQ(relation->convert(OtherTime((t + offset).time_since_epoch())), t);
  }
}

TEST(ClockRelation, TwoOscillatorsAreJoinedWithinSigma) {
  double squares = 0, largest_ns = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Computer a(seed, kFirstForm, host_time_ns(5'000'000'000)),
        b(seed + 100, kOtherForm, host_time_ns(9'876'543'210'123));
    const auto relation = ClockRelation::fit(a.seen(0, 3600), b.seen(60, 3500));
    ASSERT_TRUE(relation.ok()) << relation.error().message;
    HostTime before{};
    for (int i = 0; i < 3600; i += 7) {  // also before and after the common seconds
      const GpsTime t = some_begin() + seconds(i);
      const HostTime restated = relation->convert(b.other(t));
      EXPECT_GT(restated, before);
      before = restated;
      const double error = static_cast<double>((restated - a.clock.host(t)).count());
      const double share = error / static_cast<double>(relation->sigma(b.other(t)).count());
      EXPECT_LT(std::abs(share), 5) << "seed " << seed << ", " << i << " s: " << error << " ns";
      squares += share * share;
      largest_ns = std::max(largest_ns, std::abs(error));
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 1.2);
  EXPECT_LT(largest_ns, 20'000) << "of pulses that jitter by 2 us";
  RecordProperty("largest_ns", static_cast<int>(largest_ns));
}

TEST(ClockRelation, WrongEdgesAreLeftOut) {
  Computer a(3, kFirstForm, host_time_ns(5'000'000'000)), b(4, kOtherForm, host_time_ns(77));
  const auto relation = ClockRelation::fit(a.seen(0, 600), b.seen(0, 600, 2, [](int i) {
    return i % 10 == 3 ? nanoseconds(40'000'000) : i % 25 == 0 ? nanoseconds(-300'000) : nanoseconds(0);
  }));
  ASSERT_TRUE(relation.ok()) << relation.error().message;
  EXPECT_EQ(relation->left_out(), 60u + 24u);
  for (int i = 0; i < 600; ++i) {
    const GpsTime t = some_begin() + seconds(i);
    EXPECT_LT(std::chrono::abs(relation->convert(b.other(t)) - a.clock.host(t)), us(10)) << i;
  }
}

TEST(ClockRelation, SigmaGrowsWithoutSeconds) {
  Computer a(5, kFirstForm, host_time_ns(5'000'000'000)), b(6, kOtherForm, host_time_ns(77));
  auto seen = a.seen(600, 1800);
  std::erase_if(seen, [&](const SecondSeen& one) {
    const std::int64_t i = one.second - seen.front().second;
    return i > 300 && i < 900;  // a tunnel
  });
  const auto relation = ClockRelation::fit(seen, b.seen(0, 3600));
  ASSERT_TRUE(relation.ok()) << relation.error().message;
  const auto sigma = [&](int i) { return relation->sigma(b.other(some_begin() + seconds(i))); };
  EXPECT_LT(sigma(800), us(5));
  EXPECT_GT(sigma(1200), us(20)) << "in the tunnel";
  EXPECT_GT(sigma(200), us(30)) << "before the first";
  EXPECT_GT(sigma(3000), us(100)) << "after the last";
}

TEST(ClockRelation, TimesThatAreDamagedDoNotOverflow) {
  Computer a(9, kFirstForm, host_time_ns(5'000'000'000)), b(10, kOtherForm, host_time_ns(77));
  auto first = a.seen(0, 100), other = b.seen(0, 100);
  first[3].at = HostTime::max();
  first[4].at = HostTime::min();
  other[5].at = HostTime::min();
  other[6].at = HostTime::max();
  const auto relation = ClockRelation::fit(first, other);
  ASSERT_TRUE(relation.ok()) << relation.error().message;
  EXPECT_EQ(relation->common_seconds(), 96u);
  EXPECT_LT(relation->convert(OtherTime::min()), relation->convert(OtherTime::max()));
  EXPECT_GT(relation->sigma(OtherTime::max()), seconds(1));
}

std::string refusal(const std::vector<SecondSeen>& first, const std::vector<SecondSeen>& other) {
  const auto relation = ClockRelation::fit(first, other);
  return relation.ok() ? std::string("joined") : relation.error().message;
}

TEST(ClockRelation, WhatCannotBeJoinedIsRefused) {
  Computer a(7, kFirstForm, host_time_ns(5'000'000'000)), b(8, kOtherForm, host_time_ns(77));
  EXPECT_THAT(refusal({}, b.seen(0, 100)), HasSubstr("0 seconds of GPS time in common"));
  EXPECT_THAT(refusal(a.seen(0, 100), b.seen(96, 200)), HasSubstr("4 seconds of GPS time in common"));
  EXPECT_EQ(refusal(a.seen(0, 100), b.seen(95, 200)), "joined");
  const auto stepping = [](int i) { return nanoseconds(i < 300 ? 0 : 1'000'000'000); };
  EXPECT_THAT(refusal(a.seen(0, 1000), b.seen(0, 1000, 2, stepping)), HasSubstr("clocks"));
  const auto creeping = [](int i) { return nanoseconds(i < 300 ? 0 : 500'000); };
  EXPECT_THAT(refusal(a.seen(0, 1000), b.seen(0, 1000, 2, creeping)), HasSubstr("clocks"));
  const auto racing = [](int i) { return nanoseconds(i * 500'000); };
  EXPECT_THAT(refusal(a.seen(0, 1000), b.seen(0, 1000, 2, racing)), HasSubstr("ppm"));
  EXPECT_THAT(refusal(a.seen(0, 100), b.seen(0, 100, 200'000)), testing::Not(HasSubstr("joined")));
}

}  // namespace
}  // namespace hueline::sync
