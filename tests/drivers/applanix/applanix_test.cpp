// Groups of an Applanix POS, made here by hand as its interface description lays them out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/applanix/applanix_decoder.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using testing::ElementsAre;

constexpr std::uint8_t kGpsAndPos = 0x01, kPosAndGps = 0x10, kUtcAndPos = 0x02, kPosAlone = 0x00;

struct Times {
  double first = 0, second = 0;
  std::uint8_t types = kGpsAndPos;
};
Bytes group(int number, const Times& times, const Bytes& content) {
  Fields f;
  f.bytes = bytes_of("$GRP");
  f.put(static_cast<std::uint16_t>(number));
  const std::size_t total = (34 + content.size() + 4 + 3) / 4 * 4;
  f.put(static_cast<std::uint16_t>(total - 8)).put(times.first).put(times.second).put(12.5).put(times.types);
  f.put(std::uint8_t{1});
  f.bytes = f.bytes + content;
  f.bytes.resize(total - 4);
  Bytes out = f.bytes + Bytes{0, 0, '$', '#'};
  unsigned sum = 0;
  for (std::size_t i = 0; i < out.size(); i += 2) sum += out[i] | static_cast<unsigned>(out[i + 1]) << 8;
  const auto balance = static_cast<std::uint16_t>(0x10000u - (sum & 0xFFFFu));
  out[out.size() - 4] = static_cast<std::uint8_t>(balance);
  out[out.size() - 3] = static_cast<std::uint8_t>(balance >> 8);
  return out;
}
Bytes navigation(const Times& times, std::uint8_t alignment = 0) {
  Fields f;
  f.put(47.3).put(8.5).put(450.0).put(3.0f).put(4.0f).put(-0.5f).put(1.0).put(-2.0).put(359.0).put(0.0);
  f.zeros(32).put(alignment);
  return group(1, times, f.bytes);
}
Bytes status(std::uint32_t week, double offset = 18, int channels = 3) {
  Fields f;
  f.put(std::int8_t{7}).put(std::uint8_t{3}).put(static_cast<std::uint16_t>(20 * channels));
  f.zeros(static_cast<std::size_t>(20 * channels)).put(1.0f).put(1.0f).put(0.0f).put(std::uint16_t{1});
  f.put(week).put(offset).put(0.1f).put(50.0f).put(std::uint16_t{16}).put(std::uint32_t{0});
  return group(3, {100, 100}, f.bytes);
}
Bytes event(int number, const Times& times, std::uint32_t count) {
  return group(number, times, Fields{}.put(count).bytes);
}
Bytes pulse(const Times& times, std::uint8_t state) {
  return group(7, times, Fields{}.put(std::uint32_t{9}).put(state).bytes);
}
GpsTime at(double seconds) { return from_gps_week(2408, from_seconds(seconds)); }

Heard decode(const Bytes& bytes, ApplanixDecoder::Config config = {}) {
  ApplanixDecoder decoder(config);
  Heard heard = hear(decoder, bytes, 1);
  EXPECT_EQ(heard.bytes(), bytes.size());
  EXPECT_EQ(heard.counts.malformed_bytes, 0u);
  return heard;
}

TEST(Applanix, LengthsAreThoseOfTheDescription) {
  EXPECT_EQ(navigation({}).size(), 132u + 8);
  EXPECT_EQ(status(2408).size(), 76u + 60 + 8);
  EXPECT_EQ(event(5, {}, 1).size(), 36u + 8);
  EXPECT_EQ(pulse({}, 2).size(), 36u + 8);
}

TEST(Applanix, SolutionOnEachScale) {
  for (const Times& times :
       {Times{100.005, 7, kGpsAndPos}, Times{7, 100.005, kPosAndGps}, Times{82.005, 7, kUtcAndPos}}) {
    const auto all = decode(status(2408) + navigation(times)).all<InsSolution>();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].time, at(100.005));
    EXPECT_TRUE(all[0].is_good);
    EXPECT_NEAR(all[0].position.latitude, 47.3 * kRadPerDeg, 1e-15);
    EXPECT_NEAR(all[0].velocity_enu.x(), 4, 1e-12);
    EXPECT_NEAR(all[0].velocity_enu.y(), 3, 1e-12);
    EXPECT_NEAR(all[0].velocity_enu.z(), 0.5, 1e-12);
    EXPECT_NEAR(all[0].attitude.roll, 1 * kRadPerDeg, 1e-12);
    EXPECT_NEAR(all[0].attitude.pitch, -2 * kRadPerDeg, 1e-12);
    EXPECT_NEAR(all[0].attitude.heading, 359 * kRadPerDeg, 1e-12);
  }
}

TEST(Applanix, AlignmentDecidesWhatIsGood) {
  const auto good = [](std::uint8_t alignment, bool accepts) {
    return decode(status(2408) + navigation({100, 7}, alignment), {accepts}).all<InsSolution>().at(0).is_good;
  };
  EXPECT_TRUE(good(0, false));
  EXPECT_FALSE(good(1, false));
  EXPECT_TRUE(good(1, true));
  EXPECT_FALSE(good(2, true));
}

TEST(Applanix, ErrorsBelongToTheirMoment) {
  Fields f;
  for (const float value : {0.01f, 0.02f, 0.03f, 0.001f, 0.002f, 0.003f, 0.1f, 0.2f, 0.3f, 0.0f, 0.0f, 0.0f})
    f.put(value);
  const auto all = decode(status(2408) + group(2, {100, 7}, f.bytes)).all<InsUncertainty>();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].time, at(100));
  EXPECT_NEAR(all[0].sigma[0], 0.02, 1e-8);
  EXPECT_NEAR(all[0].sigma[1], 0.01, 1e-8);
  EXPECT_NEAR(all[0].sigma[8], 0.3 * kRadPerDeg, 1e-8);
}

TEST(Applanix, EventsAndPulses) {
  const Heard heard =
      decode(status(2408) + pulse({100.0000004, 7}, 2) + event(5, {100.25, 7}, 41) + event(6, {100.5, 7}, 42));
  const auto marks = heard.all<EventMark>();
  ASSERT_EQ(marks.size(), 2u);
  EXPECT_EQ(marks[0].time, at(100.25));
  EXPECT_EQ(marks[0].input, 1);
  EXPECT_EQ(marks[1].input, 2);
  EXPECT_EQ(marks[1].pulse_count, 42u);
  EXPECT_TRUE(marks[0].is_valid);
  ASSERT_EQ(heard.all<TimeLabel>().size(), 1u);
  EXPECT_EQ(heard.all<TimeLabel>()[0].second, at(100));
  EXPECT_EQ(heard.all<TimeLabel>()[0].utc_offset, std::chrono::seconds(18));
}

TEST(Applanix, WithoutSynchronisationNothingIsTrusted) {
  const Heard heard = decode(status(2408) + pulse({100, 7}, 1) + event(5, {100.25, 7}, 41));
  EXPECT_TRUE(heard.all<TimeLabel>().empty());
  EXPECT_FALSE(heard.all<EventMark>().at(0).is_valid);
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime, FaultKind::NoTime));
}

TEST(Applanix, WithoutWeekOrScaleNothingIsStamped) {
  EXPECT_THAT(decode(navigation({100, 7})).faults(), ElementsAre(FaultKind::NoTime));
  const Heard heard = decode(status(2408) + navigation({100, 7, kPosAlone}));
  EXPECT_TRUE(heard.all<InsSolution>().empty());
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime));
}

TEST(Applanix, WeeksModulo1024AndTheTurnOfTheWeek) {
  EXPECT_EQ(decode(status(2408 - 2048) + navigation({100, 7})).all<InsSolution>().at(0).time, at(100));
  // A week that no count modulo 1024 gives is as it is: a drive in 2009.
  EXPECT_EQ(decode(status(1556, 15) + navigation({100, 7})).all<InsSolution>().at(0).time,
            from_gps_week(1556, std::chrono::seconds(100)));
  EXPECT_EQ(decode(status(1023) + navigation({100, 7})).all<InsSolution>().at(0).time,
            from_gps_week(2047, std::chrono::seconds(100)));
  const auto all = decode(status(2407) + navigation({604'799.5, 7}) + navigation({0.5, 7})).all<InsSolution>();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1].time - all[0].time, std::chrono::seconds(1));
}

TEST(Applanix, ABrokenGroupDoesNotHideTheNext) {
  Bytes broken = navigation({100, 7});
  broken[40] ^= 4;
  ApplanixDecoder decoder({});
  const Bytes all = status(2408) + broken + navigation({100.005, 7});
  const Heard heard = hear(decoder, all, 7);
  EXPECT_EQ(heard.bytes(), all.size());
  EXPECT_EQ(heard.counts.malformed_bytes, broken.size());
  EXPECT_EQ(heard.counts.malformed_messages, 1u);
  EXPECT_EQ(heard.all<InsSolution>().size(), 1u);
}

}  // namespace
}  // namespace hueline::drivers
