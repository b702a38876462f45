// Logs that never came, found from the times of those that came.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <random>

#include "core/calendar.hpp"
#include "drivers/novatel/decoder.hpp"
#include "drivers/stream/log_cycle.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using std::chrono::milliseconds;
using testing::ElementsAre;

constexpr std::int64_t kWeekMs = 604'800'000;

/// A log on its way to the computer.
struct Sent {
  std::int64_t ms = 0;  ///< its header's time, of all weeks
  std::int64_t arrives_us = 0;
  Bytes bytes;
  bool is_filter = false;
};

Bytes log_bytes(unsigned id, std::int64_t ms, unsigned time_status = kFineSteering) {
  const auto week = static_cast<unsigned>(ms / kWeekMs);
  const auto in_week = static_cast<std::uint32_t>(ms % kWeekMs);
  if (id == 508) return short_message(id, week, in_week, pva_body({.week = week, .seconds = in_week * 1e-3}));
  const std::size_t body = id == 42 ? 72 : id == 101 ? 44 : id == 99 ? 44 : 52;
  return long_message(id, week, in_week, Bytes(body), time_status);
}

/// INSPVAS every `period_ms`, and INSSTDEV, BESTPOS and TIME every second, each with its own latency. They are on one
/// line, so they stay in order.
std::vector<Sent> stream(std::int64_t begin_ms, std::int64_t length_ms, std::int64_t period_ms, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Sent> out;
  const auto add = [&](unsigned id, std::int64_t ms, int least_us, int most_us) {
    std::int64_t arrives_us = (ms - begin_ms) * 1000 + std::uniform_int_distribution<int>(least_us, most_us)(random);
    if (!out.empty() && id == 508) arrives_us = std::max(arrives_us, out.back().arrives_us);
    out.push_back({ms, arrives_us, log_bytes(id, ms), id == 508});
  };
  for (std::int64_t ms = begin_ms; ms < begin_ms + length_ms; ms += period_ms) add(508, ms, 3'000, 10'000);
  for (std::int64_t ms = begin_ms; ms < begin_ms + length_ms; ms += 1000) {
    add(2051, ms, 3'000, 10'000);
    add(42, ms, 20'000, 60'000);
    add(101, ms, 50'000, 150'000);
  }
  std::stable_sort(out.begin(), out.end(), [](const Sent& a, const Sent& b) { return a.arrives_us < b.arrives_us; });
  return out;
}

class Line {
 public:
  void bring(std::span<const std::byte> bytes, std::int64_t at_us) {
    decoder_.decode(packet_of(bytes, host_time_ns(1'000'000'000 + at_us * 1000)), out_);
  }
  void bring(const Sent& sent) { bring(sent.bytes, sent.arrives_us); }
  void flush() { decoder_.flush(out_); }
  void reset() { decoder_.reset(); }
  std::uint64_t lost() const {
    std::uint64_t sum = 0;
    for (const Fault& fault : all_of<Fault>(out_)) sum += fault.kind == FaultKind::Lost ? fault.count : 0;
    return sum;
  }
  std::vector<std::string> told() const {
    std::vector<std::string> out;
    for (const Fault& fault : all_of<Fault>(out_))
      if (fault.kind == FaultKind::Lost) out.push_back(fault.detail);
    return out;
  }

 private:
  NovatelDecoder decoder_{NovatelDecoder::Config{}};
  std::vector<Measurement> out_;
};

constexpr std::int64_t kBegin = 2300 * kWeekMs + 100'000'000;
constexpr std::int64_t kKnown_us = 10'000'000;  // all periods are known after nine logs

struct Losses {
  std::uint64_t lost = 0, told = 0;
};
/// For 15 s a share of all logs is lost by chance.
Losses lose(std::int64_t begin, std::int64_t period_ms, double share, unsigned seed) {
  std::mt19937 random(seed);
  Line line;
  Losses out;
  for (const Sent& log : stream(begin, 30'000, period_ms, seed)) {
    const bool is_spoilt = log.arrives_us > kKnown_us && log.arrives_us < 25'000'000;
    if (is_spoilt && std::bernoulli_distribution(share)(random))
      ++out.lost;
    else
      line.bring(log);
  }
  line.flush();
  out.told = line.lost();
  return out;
}

RC_GTEST_PROP(NovatelLosses, AreToldWithTheirNumberWhateverTheShareThatIsLost, ()) {
  // In some cases the week ends in the middle.
  const std::int64_t begin = *rc::gen::element(kBegin, 2301 * kWeekMs - 15'000);
  const Losses found = lose(begin, *rc::gen::element(5, 10, 20, 100), *rc::gen::element(0.01, 0.1, 0.3, 0.5),
                            *rc::gen::inRange(0u, 1'000'000u));
  RC_ASSERT(found.told == found.lost);
}

TEST(NovatelLosses, ARunThatALossyLineLosesByChanceIsNotTheFiltersDoing) {
  // Eight and more logs of the filter in a row, while others come between them.
  const Losses found = lose(kBegin, 100, 0.5, 136'300);
  EXPECT_EQ(found.lost, 93u);
  EXPECT_EQ(found.told, found.lost);
}

TEST(NovatelLosses, NineOfASlowLogInARowAreLostIfTheLineLosesOfTheOthersToo) {
  const Losses found = lose(kBegin, 100, 0.3, 482'860);
  EXPECT_EQ(found.lost, 74u);
  EXPECT_EQ(found.told, found.lost);
}

RC_GTEST_PROP(NovatelLosses, ABurstIsToldWhole, ()) {
  const auto sent = stream(kBegin, 30'000, 10, *rc::gen::inRange(0u, 1'000'000u));
  const auto first = *rc::gen::inRange<std::int64_t>(kKnown_us, 20'000'000),
             last = first + *rc::gen::inRange<std::int64_t>(1, 6'000'000);
  Line line;
  std::uint64_t lost = 0;
  for (const Sent& log : sent) {
    if (log.arrives_us >= first && log.arrives_us < last)
      ++lost;
    else
      line.bring(log);
  }
  line.flush();
  RC_ASSERT(line.lost() == lost);
}

RC_GTEST_PROP(NovatelLosses, NothingIsToldOfAStreamThatStallsOrComesInPieces, ()) {
  const auto sent = stream(kBegin, 20'000, 10, *rc::gen::inRange(0u, 1'000'000u));
  const auto from = *rc::gen::inRange<std::int64_t>(0, 15'000'000),
             to = from + *rc::gen::inRange<std::int64_t>(0, 5'000'000);
  const auto piece = *rc::gen::inRange<std::size_t>(1, 300);
  Line line;
  for (const Sent& log : sent) {
    const std::int64_t at = log.arrives_us > from && log.arrives_us < to ? to : log.arrives_us;
    for (std::size_t i = 0; i < log.bytes.size(); i += piece)
      line.bring(std::span(log.bytes).subspan(i, std::min(piece, log.bytes.size() - i)), at);
  }
  line.flush();
  RC_ASSERT(line.lost() == 0u);
}

RC_GTEST_PROP(NovatelLosses, WhatCameBrokenIsNotLostToo, ()) {
  const auto seed = *rc::gen::inRange(0u, 1'000'000u);
  std::mt19937 random(seed);
  Line line;
  for (Sent log : stream(kBegin, 30'000, 10, seed)) {
    if (log.arrives_us > kKnown_us && log.arrives_us < 25'000'000 && std::bernoulli_distribution(0.1)(random))
      log.bytes[random() % log.bytes.size()] ^= std::byte{0x5A};
    line.bring(log);
  }
  line.flush();
  RC_ASSERT(line.lost() == 0u);
}

TEST(NovatelLosses, AreNamed) {
  Line line;
  for (const Sent& log : stream(kBegin, 20'000, 10, 1)) {
    const std::int64_t ms = log.ms - kBegin;
    if (ms == 12'000 || ms == 13'110 || ms == 13'120) continue;
    line.bring(log);
  }
  line.flush();
  EXPECT_EQ(line.lost(), 6u);
  EXPECT_THAT(line.told(), ElementsAre("logs missing, by the period of their times: 1 INSPVAS",
                                       "logs missing, by the period of their times: 2 INSPVAS",
                                       "logs missing, by the period of their times: 1 INSSTDEV",
                                       "logs missing, by the period of their times: 1 BESTPOS, 1 TIME"));
}

TEST(NovatelLosses, WhatTheFilterDoesNotGiveIsNotLost) {
  Line line;
  for (const Sent& log : stream(kBegin, 30'000, 10, 1)) {
    const std::int64_t ms = log.ms - kBegin;
    if (ms >= 12'500 && ms < 15'700 && (log.is_filter || log.bytes[4] == std::byte{0x03}))
      continue;  // INSPVAS, INSSTDEV
    line.bring(log);
  }
  line.flush();
  EXPECT_EQ(line.lost(), 0u);
}

TEST(NovatelLosses, AnotherRateIsNoLoss) {
  for (const auto& [before, after] :
       {std::pair<std::int64_t, std::int64_t>{5, 10}, {10, 5}, {20, 100}, {10, 1000}, {50, 20}}) {
    Line line;
    for (std::int64_t ms = 0; ms < 40'000; ms += ms < 20'000 ? before : after)
      line.bring(log_bytes(508, kBegin + ms), ms * 1000);
    line.flush();
    EXPECT_EQ(line.lost(), 0u) << before << " to " << after;
  }
}

TEST(NovatelLosses, AnInertialUnitThatDoesNotFitTheRateIsNoLoss) {
  Line line;
  for (std::int64_t ms = 0; ms < 20'000; ms += 10)
    line.bring(log_bytes(508, kBegin + (ms + 7) / 8 * 8), ms * 1000 + 9'000);  // 125 Hz asked for 100
  line.flush();
  EXPECT_EQ(line.lost(), 0u);
}

TEST(NovatelLosses, LogsGivenWhenSomethingChangesAreNone) {
  Line line;
  for (const std::int64_t s : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 18, 19, 31, 32})
    line.bring(long_message(1335, 2300, static_cast<std::uint32_t>(100'000'000 + s * 1000), Bytes(48)),
               s * 1'000'000);  // HEADING2
  line.flush();
  EXPECT_EQ(line.lost(), 0u);
}

/// After a restart of the receiver, or after its clock was set, nothing is known about the time between.
TEST(NovatelLosses, AClockThatIsSetIsNoLoss) {
  for (const std::int64_t jump :
       std::initializer_list<std::int64_t>{1000, -1000, 3'600'000, 18'000, 1024 * kWeekMs, -1024 * kWeekMs}) {
    Line line;
    for (std::int64_t ms = 0; ms < 30'000; ms += 10)
      line.bring(log_bytes(508, kBegin + ms + (ms < 20'000 ? 0 : jump)), ms * 1000);
    line.flush();
    EXPECT_EQ(line.lost(), 0u) << jump;
  }
  Line off;  // for ten minutes: nothing was sent
  for (std::int64_t ms = 0; ms < 30'000; ms += 10)
    off.bring(log_bytes(508, kBegin + ms + (ms < 20'000 ? 0 : 600'000)), (ms + (ms < 20'000 ? 0 : 600'000)) * 1000);
  off.flush();
  EXPECT_EQ(off.lost(), 0u);
}

TEST(NovatelLosses, NoTimeOrAnotherConnectionBeginsAnew) {
  for (const bool is_reset : {false, true}) {
    Line line;
    for (std::int64_t ms = 0; ms < 30'000; ms += 10) {
      if (ms == 20'000 && is_reset) line.reset();
      if (ms == 20'000 && !is_reset) line.bring(log_bytes(42, kBegin + ms, 60), ms * 1000);  // COARSE
      if (ms < 20'000 || ms >= 21'000) line.bring(log_bytes(508, kBegin + ms), ms * 1000);
    }
    line.flush();
    EXPECT_EQ(line.lost(), 0u) << is_reset;
  }
}

/// Over datagrams, one log may overtake another.
TEST(NovatelLosses, WhatComesLateIsNotLost) {
  Line line;
  std::uint64_t lost = 0;
  for (std::int64_t ms = 0; ms < 30'000; ms += 10) {
    const bool is_late = ms > 15'000 && ms % 500 == 100, is_lost = ms > 15'000 && ms % 500 == 300;
    lost += is_lost;
    if (!is_late && !is_lost) line.bring(log_bytes(508, kBegin + ms), ms * 1000 + 5'000);
    if (ms > 15'000 && ms % 500 == 120) line.bring(log_bytes(508, kBegin + ms - 20), ms * 1000 + 5'100);
  }
  line.flush();
  EXPECT_EQ(line.lost(), lost);
}

TEST(LogCycle, LearnsFromEqualStepsAndTellsNothingBefore) {
  LogCycle cycle;
  const auto take = [&](std::int64_t ms) {
    return cycle.take(GpsTime(milliseconds(kBegin + ms)), host_time_ns(ms * 1'000'000));
  };
  for (const std::int64_t ms : {0, 10, 20, 40, 50, 60, 70, 80, 90, 100}) EXPECT_FALSE(take(ms));
  EXPECT_FALSE(cycle.period());
  for (const std::int64_t ms : {110, 120}) EXPECT_FALSE(take(ms));
  EXPECT_EQ(cycle.period(), milliseconds(10));
  const auto gap = take(150);
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->missing, 2u);
  EXPECT_FALSE(cycle.settled()) << "on trial";
  for (const std::int64_t ms : {160, 170, 180, 190}) take(ms);
  EXPECT_EQ(cycle.settled()->missing, 2u);
  EXPECT_FALSE(cycle.settled()) << "once";
}

}  // namespace
}  // namespace hueline::drivers
