// NCOM packets, made here by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/angle.hpp"
#include "drivers/oxts/oxts_decoder.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using std::chrono::milliseconds;
using std::chrono::minutes;
using testing::ElementsAre;

constexpr std::int32_t kMinute = 24'272'640;  // 2026-02-22

void put24(Fields& f, std::int32_t value) {
  for (int shift = 0; shift < 24; shift += 8)
    f.put(static_cast<std::uint8_t>(static_cast<std::uint32_t>(value) >> shift));
}
Bytes packet(int ms, int channel, const Bytes& content, int state = 4) {
  Fields f;
  f.put(std::uint8_t{0xE7}).put(static_cast<std::uint16_t>(ms));
  f.zeros(18).put(static_cast<std::uint8_t>(state));
  const auto sum = [&] {
    unsigned all = 0;
    for (std::size_t i = 1; i < f.bytes.size(); ++i) all += f.bytes[i];
    f.put(static_cast<std::uint8_t>(all));
  };
  sum();
  f.put(47.3 * kRadPerDeg).put(8.5 * kRadPerDeg).put(450.0f);
  for (const std::int32_t value : {30'000, 40'000, -5'000}) put24(f, value);  // north, east, down, 0.1 mm/s
  for (const double deg : {-1.0, -2.0, 1.0}) put24(f, static_cast<std::int32_t>(std::lround(deg * kRadPerDeg * 1e6)));
  sum();
  f.put(static_cast<std::uint8_t>(channel));
  f.bytes = f.bytes + content;
  f.bytes.resize(71);
  sum();
  return f.bytes;
}
Bytes minute(std::int32_t value = kMinute) { return Fields{}.put(value).bytes; }
Bytes accuracy(std::uint16_t a, std::uint16_t b, std::uint16_t c, std::uint8_t age = 0) {
  return Fields{}.put(a).put(b).put(c).put(age).bytes;
}
Bytes trigger(int ms, std::int8_t fine, std::uint8_t count) {
  return Fields{}.put(kMinute).put(static_cast<std::uint16_t>(ms)).put(fine).put(count).bytes;
}
GpsTime at(std::int64_t ms) { return GpsTime(minutes(kMinute) + milliseconds(ms)); }

Heard decode(const Bytes& bytes) {
  OxtsDecoder decoder({});
  Heard heard = hear(decoder, bytes, 1);
  EXPECT_EQ(heard.bytes(), bytes.size());
  return heard;
}

TEST(Oxts, PacketsGetTheirMinuteAndSigmas) {
  const Heard heard = decode(packet(59'980, 0, minute()) + packet(59'990, 3, accuracy(10, 20, 30)) +
                             packet(0, 4, accuracy(1, 2, 3)) + packet(10, 5, accuracy(300, 200, 100)));
  EXPECT_EQ(heard.counts.malformed_bytes, 0u);
  const auto all = heard.all<InsSolution>();
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[0].time, at(59'980));
  EXPECT_EQ(all[3].time, at(60'010));  // the minute went on by itself
  EXPECT_TRUE(all[3].is_good);
  EXPECT_NEAR(all[3].position.latitude, 47.3 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(all[3].velocity_enu.x(), 4, 1e-9);
  EXPECT_NEAR(all[3].velocity_enu.y(), 3, 1e-9);
  EXPECT_NEAR(all[3].velocity_enu.z(), 0.5, 1e-9);
  EXPECT_NEAR(all[3].attitude.heading, 359 * kRadPerDeg, 1e-6);
  EXPECT_NEAR(all[3].attitude.pitch, -2 * kRadPerDeg, 1e-6);
  EXPECT_NEAR(all[3].attitude.roll, 1 * kRadPerDeg, 1e-6);
  EXPECT_FALSE(all[2].sigma.has_value());
  ASSERT_TRUE(all[3].sigma.has_value());
  EXPECT_NEAR((*all[3].sigma)[0], 0.02, 1e-12);
  EXPECT_NEAR((*all[3].sigma)[1], 0.01, 1e-12);
  EXPECT_NEAR((*all[3].sigma)[8], 0.003, 1e-12);
  ASSERT_EQ(heard.all<TimeLabel>().size(), 2u);
  EXPECT_EQ(heard.all<TimeLabel>()[1].second, at(60'000));
}

TEST(Oxts, WithoutAMinuteNothingIsStamped) {
  const Heard heard = decode(packet(10, 3, accuracy(1, 1, 1)) + packet(20, 0, minute(0)));
  EXPECT_TRUE(heard.all<InsSolution>().empty());
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime));
}

TEST(Oxts, BehindALongGapTheMinuteIsWaitedFor) {
  // By the times within the minute 40 s are missing; it may be 100 s or more.
  const Heard heard = decode(packet(10'000, 0, minute()) + packet(50'000, 3, accuracy(1, 1, 1)) +
                             packet(50'010, 0, minute(kMinute + 1)) + packet(50'020, 3, accuracy(1, 1, 1)));
  const auto all = heard.all<InsSolution>();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[1].time, at(110'010));
  EXPECT_EQ(all[2].time, at(110'020));
  EXPECT_THAT(heard.faults(), testing::Contains(FaultKind::NoTime));
}

TEST(Oxts, AGapOfWholeMinutesIsTold) {
  const auto faults = decode(packet(10'000, 0, minute()) + packet(10'010, 3, accuracy(1, 1, 1)) +
                             packet(10'020, 0, minute(kMinute + 1)) + packet(10'030, 3, accuracy(1, 1, 1)))
                          .faults();
  EXPECT_THAT(faults, ElementsAre(FaultKind::LabelConflict));
  EXPECT_TRUE(decode(packet(59'990, 0, minute()) + packet(10, 0, minute(kMinute + 1))).faults().empty());
}

TEST(Oxts, BehindALongSilenceTheMinuteIsWaitedFor) {
  OxtsDecoder decoder({});
  std::vector<Measurement> out;
  std::int64_t second = 0;
  // 2 minutes and 10 ms pass between the first two packets, as their arrivals tell.
  for (const Bytes& bytes : {packet(10'000, 0, minute()), packet(10'010, 3, accuracy(1, 1, 1)),
                             packet(10'020, 0, minute(kMinute + 2)), packet(10'030, 3, accuracy(1, 1, 1))}) {
    Packet one;
    one.received = host_time_ns(1'000'000'000 + (second > 0 ? 120'000'000'000 : 0) + 10'000'000 * second);
    ++second;
    one.bytes = Buffer::copy_of(std::as_bytes(std::span(bytes)));
    decoder.decode(one, out);
  }
  std::vector<GpsTime> times;
  for (const Measurement& m : out)
    if (const auto* solution = std::get_if<InsSolution>(&m)) times.push_back(solution->time);
  EXPECT_THAT(times, ElementsAre(at(10'000), at(130'020), at(130'030)));
}

TEST(Oxts, AGapOverTheTurnOfAMinuteAndAnOvertakenPacket) {
  const Heard heard = decode(packet(57'000, 0, minute()) + packet(1'000, 3, accuracy(1, 1, 1)) +
                             packet(990, 3, accuracy(1, 1, 1)) + packet(1'010, 3, accuracy(1, 1, 1)));
  const auto all = heard.all<InsSolution>();
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[1].time, at(61'000));
  EXPECT_EQ(all[2].time, at(60'990));
  EXPECT_EQ(all[3].time, at(61'010));
  const auto turn = decode(packet(59'980, 0, minute()) + packet(0, 3, accuracy(1, 1, 1)) +
                           packet(59'990, 3, accuracy(1, 1, 1)) + packet(10, 3, accuracy(1, 1, 1)))
                        .all<InsSolution>();
  ASSERT_EQ(turn.size(), 4u);
  EXPECT_EQ(turn[2].time, at(59'990));
  EXPECT_EQ(turn[3].time, at(60'010));
}

TEST(Oxts, TriggersOnceEach) {
  const Heard heard =
      decode(packet(100, 0, minute()) + packet(110, 24, trigger(105, 100, 7)) + packet(120, 24, trigger(105, 100, 7)) +
             packet(130, 43, trigger(125, -3, 1)) + packet(132, 43, trigger(131, 0, 2)) + packet(131, 0, minute(), 22));
  const auto marks = heard.all<EventMark>();
  ASSERT_EQ(marks.size(), 3u);
  EXPECT_EQ(marks[0].time, at(105) + std::chrono::microseconds(400));
  EXPECT_EQ(marks[0].input, 1);
  EXPECT_EQ(marks[0].pulse_count, 7u);
  EXPECT_EQ(marks[1].time, at(125) - std::chrono::microseconds(12));
  EXPECT_EQ(marks[1].input, 2);
  EXPECT_TRUE(marks[2].is_valid);
  EXPECT_EQ(heard.all<InsSolution>().size(), 5u);  // the packet of a trigger is none
  const auto early = decode(packet(100, 0, minute(), 2) + packet(105, 24, trigger(105, 0, 7), 20)).all<EventMark>();
  ASSERT_EQ(early.size(), 1u);
  EXPECT_FALSE(early[0].is_valid);  // the system was initialising
}

TEST(Oxts, StatesAndBrokenPackets) {
  EXPECT_FALSE(decode(packet(100, 0, minute(), 2)).all<InsSolution>().at(0).is_good);
  EXPECT_TRUE(decode(packet(100, 0, minute(), 1)).all<InsSolution>().empty());
  Bytes broken = packet(110, 3, accuracy(1, 1, 1));
  broken[30] ^= 1;
  const Heard heard = decode(packet(100, 0, minute()) + broken + packet(120, 3, accuracy(1, 1, 1)));
  EXPECT_EQ(heard.counts.malformed_bytes, 72u);
  EXPECT_EQ(heard.all<InsSolution>().size(), 2u);
}

}  // namespace
}  // namespace hueline::drivers
