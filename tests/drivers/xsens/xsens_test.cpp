// Xbus messages with MTData2, made here by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/xsens/xsens_decoder.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using testing::ElementsAre;

template <class T>
Bytes big(T value) {
  Bytes out = Fields{}.put(value).bytes;
  std::reverse(out.begin(), out.end());
  return out;
}
Bytes datum(std::uint16_t id, const Bytes& value) {
  return big(id) + Bytes{static_cast<std::uint8_t>(value.size())} + value;
}
Bytes message(std::uint8_t id, const Bytes& data) {
  Bytes out{0xFA, 0xFF, id};
  if (data.size() < 255)
    out.push_back(static_cast<std::uint8_t>(data.size()));
  else
    out = out + Bytes{255} + big(static_cast<std::uint16_t>(data.size()));
  out = out + data;
  unsigned sum = 0;
  for (std::size_t i = 1; i < out.size(); ++i) sum += out[i];
  out.push_back(static_cast<std::uint8_t>(0u - sum));
  return out;
}
Bytes utc(std::uint32_t ns = 5'000'000, std::uint8_t flags = 7) {
  return datum(0x1010, big(ns) + big(std::uint16_t{2026}) + Bytes{3, 1, 12, 0, 0, flags});
}
Bytes floats(std::initializer_list<float> values) {
  Bytes out;
  for (const float value : values) out = out + big(value);
  return out;
}
Bytes place() {
  return datum(0x5043, big(47.3) + big(8.5)) + datum(0x5023, big(450.0)) + datum(0xD010, floats({4, 3, 0.5f})) +
         datum(0xE020, big(std::uint32_t{7}));
}
/// Roll, pitch and yaw of the sensor (forward, left, up) to east, north, up: nose to the north, 2 deg down, 1 deg
/// rolled to the right.
Bytes euler(std::uint16_t frame = 0) { return datum(static_cast<std::uint16_t>(0x2030 | frame), floats({1, 2, 90})); }

Heard decode(const Bytes& bytes) {
  XsensDecoder decoder({});
  Heard heard = hear(decoder, bytes, 1);
  EXPECT_EQ(heard.bytes(), bytes.size());
  return heard;
}

TEST(Xsens, SolutionInOurAxes) {
  const Heard heard = decode(message(0x36, utc() + euler() + place()));
  const auto all = heard.all<InsSolution>();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].time, *from_utc({2026, 3, 1, 12, 0, 0, 5'000'000}));
  EXPECT_TRUE(all[0].is_good);
  EXPECT_NEAR(all[0].position.latitude, 47.3 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(std::remainder(all[0].attitude.heading, 2 * std::numbers::pi), 0, 1e-6);
  EXPECT_NEAR(all[0].attitude.pitch, -2 * kRadPerDeg, 1e-6);
  EXPECT_NEAR(all[0].attitude.roll, 1 * kRadPerDeg, 1e-6);
  EXPECT_NEAR(all[0].velocity_enu.x(), 4, 1e-6);
  ASSERT_EQ(heard.all<TimeLabel>().size(), 1u);
}

TEST(Xsens, EulerAndQuaternionInEachFrame) {
  // Nose to the east, level: the identity to ENU; yaw -90 to NWU.
  const auto heading = [](const Bytes& orientation) {
    const auto all = decode(message(0x36, utc() + orientation + place())).all<InsSolution>();
    return all.empty() ? -1 : all[0].attitude.heading * kDegPerRad;
  };
  EXPECT_NEAR(heading(datum(0x2010, floats({1, 0, 0, 0}))), 90, 1e-4);
  EXPECT_NEAR(heading(datum(0x2038, floats({0, 0, -90}))), 90, 1e-4);
  EXPECT_NEAR(heading(datum(0x2013, big(1.0) + big(0.0) + big(0.0) + big(0.0))), 90, 1e-9);
  EXPECT_NEAR(heading(datum(0x2031, big(std::int32_t{0}) + big(std::int32_t{0}) + big(std::int32_t{90 << 20}))), 0,
              1e-4);
  // By columns: the sensor's forward axis is the north, its left the west.
  EXPECT_NEAR(std::remainder(heading(datum(0x2020, floats({0, 1, 0, -1, 0, 0, 0, 0, 1}))), 360), 0, 1e-4);
  EXPECT_NEAR(heading(datum(0x2028, floats({0, -1, 0, 1, 0, 0, 0, 0, 1}))), 90, 1e-4);
  EXPECT_EQ(heading(datum(0x2020, floats({1, 0, 0, 0, 1, 0, 0, 0, -1}))), -1);  // a mirror is no orientation
  EXPECT_EQ(heading(datum(0x2020, floats({1, 0, 0, 0}))), -1);
  EXPECT_EQ(heading(euler(4)), -1);
  EXPECT_THAT(decode(message(0x36, utc() + euler(4) + place())).faults(), ElementsAre(FaultKind::Implausible));
}

TEST(Xsens, PlaceInTheEarthsFrame) {
  const auto place_of = [](double x, double y, double z) {
    return decode(message(0x36, utc() + euler() + datum(0x5033, big(x) + big(y) + big(z)) +
                                    datum(0xD010, floats({4, 3, 0.5f})) + datum(0xE020, big(std::uint32_t{7}))))
        .all<InsSolution>();
  };
  const auto all = place_of(4285941.03021, 640538.17869, 4664777.63538);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NEAR(all[0].position.latitude, 47.3 * kRadPerDeg, 1e-11);
  EXPECT_NEAR(all[0].position.longitude, 8.5 * kRadPerDeg, 1e-11);
  EXPECT_NEAR(all[0].position.ellipsoidal_height, 450, 1e-4);
  EXPECT_TRUE(place_of(0, 0, 0).empty());
}

TEST(Xsens, InertialSamplesInOurAxes) {
  const auto all =
      decode(message(0x36, utc() + datum(0x4020, floats({1, 2, 9.8f})) + datum(0x8020, floats({0.1f, 0.2f, 0.3f}))))
          .all<ImuSample>();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NEAR(all[0].specific_force_body.x(), -2, 1e-6);  // right is minus left
  EXPECT_NEAR(all[0].specific_force_body.y(), 1, 1e-6);
  EXPECT_NEAR(all[0].specific_force_body.z(), 9.8, 1e-6);
  EXPECT_NEAR(all[0].angular_rate_body.x(), -0.2, 1e-6);
}

TEST(Xsens, ATimeThatIsNotResolvedStampsNothing) {
  for (const std::uint8_t flags : {std::uint8_t{0}, std::uint8_t{3}}) {
    const Heard heard = decode(message(0x36, utc(0, flags) + euler() + place()));
    EXPECT_TRUE(heard.all<InsSolution>().empty());
    EXPECT_TRUE(heard.all<TimeLabel>().empty());
    EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime));
  }
  // Messages that need no time between them do not tell it anew.
  const Bytes untimed = message(0x36, euler() + place()), other = message(0x36, datum(0x1060, big(std::uint32_t{5})));
  EXPECT_THAT(decode(untimed + other + untimed + other + untimed).faults(), ElementsAre(FaultKind::NoTime));
}

TEST(Xsens, CounterErrorsAndLongMessages) {
  const auto counted = [](std::uint16_t n) { return message(0x36, datum(0x1020, big(n)) + utc()); };
  const auto faults = decode(counted(65534) + counted(2) + counted(1)).all<Fault>();
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].kind, FaultKind::Lost);
  EXPECT_EQ(faults[0].count, 3u);
  EXPECT_THAT(decode(message(0x42, {4})).faults(), ElementsAre(FaultKind::Refused));
  const Heard heard = decode(message(0x36, datum(0x4FF0, Bytes(250)) + utc() + euler() + place()));
  EXPECT_EQ(heard.all<InsSolution>().size(), 1u);
}

TEST(Xsens, GnssData) {
  Bytes pvt = big(std::uint32_t{0}) + big(std::uint16_t{2026}) + Bytes{3, 1, 12, 0, 0, 7} + big(std::uint32_t{20}) +
              big(std::int32_t{-100}) + Bytes{3, 0x43, 15, 0} + big(std::int32_t{85'000'000}) +
              big(std::int32_t{473'000'000}) + big(std::int32_t{450'000}) + big(std::int32_t{400'000}) +
              big(std::uint32_t{1414}) + big(std::uint32_t{2000});
  pvt.resize(94);
  const auto all = decode(message(0x36, datum(0x7010, pvt))).all<GnssFix>();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].time, *from_utc({2026, 3, 1, 12, 0, 0, 0}) - nanoseconds(100));
  EXPECT_EQ(all[0].type, FixType::RtkFloat);
  EXPECT_EQ(all[0].satellites, 15);
  EXPECT_NEAR(all[0].sigma_enu[0], 1, 1e-3);
}

}  // namespace
}  // namespace hueline::drivers
