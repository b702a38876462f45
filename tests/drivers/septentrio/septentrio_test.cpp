// SBF blocks, made here by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/septentrio/septentrio_decoder.hpp"
#include "drivers/septentrio/septentrio_logs.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using std::chrono::milliseconds;
using testing::ElementsAre;

constexpr int kWeek = 2408;

Bytes block(unsigned id, std::uint32_t ms, const Bytes& content, std::uint16_t week = kWeek) {
  Fields f;
  f.put(static_cast<std::uint16_t>(id));
  f.put(static_cast<std::uint16_t>((8 + 6 + content.size() + 3) / 4 * 4)).put(ms).put(week);
  f.bytes = f.bytes + content;
  while ((f.bytes.size() + 4) % 4 != 0) f.bytes.push_back(0);
  unsigned crc = 0;  // CRC-16/CCITT bit by bit
  for (const std::uint8_t byte : f.bytes)
    for (int bit = 7; bit >= 0; --bit) {
      const bool top = ((crc >> 15) & 1u) != ((byte >> bit) & 1u);
      crc = ((crc << 1) ^ (top ? 0x1021u : 0u)) & 0xFFFFu;
    }
  return Fields{}.put('$').put('@').put(static_cast<std::uint16_t>(crc)).bytes + f.bytes;
}
Bytes solution(std::uint32_t ms, std::uint8_t error = 0, std::uint16_t list = 0x1F) {
  Fields f;
  f.put(std::uint8_t{4}).put(error).put(std::uint16_t{0}).put(std::uint16_t{5});
  f.put(47.3 * kRadPerDeg).put(8.5 * kRadPerDeg).put(450.0).put(50.0f);
  f.put(std::uint16_t{3}).put(std::uint16_t{100}).put(std::uint8_t{0}).put(std::uint8_t{0}).put(list);
  if (list & 1) f.put(0.01f).put(0.02f).put(0.03f);  // latitude, longitude, height
  if (list & 2) f.put(359.0f).put(-2.0f).put(1.0f);  // heading, pitch, roll
  if (list & 4) f.put(0.3f).put(0.2f).put(0.1f);
  if (list & 8) f.put(4.0f).put(3.0f).put(0.5f);  // east, north, up
  if (list & 16) f.put(0.04f).put(0.03f).put(0.05f);
  return block(4226, ms, f.bytes);
}
Bytes receiver_time(std::uint32_t ms, std::uint8_t level) { return block(5914, ms, {26, 3, 1, 0, 0, 0, 18, level}); }
Bytes event(std::uint32_t ms, float offset, double bias, std::uint16_t week = kWeek) {
  return block(5924, ms, Fields{}.put(std::uint8_t{2}).put(std::uint8_t{0}).put(offset).put(bias).bytes, week);
}
Bytes fix(std::uint32_t ms, std::uint8_t mode, std::uint8_t error = 0) {
  Fields f;
  f.put(mode).put(error).put(47.3 * kRadPerDeg).put(8.5 * kRadPerDeg).put(450.0).put(50.0f).zeros(12).put(0.0f);
  f.put(0.0).put(0.0f).put(std::uint8_t{0}).put(std::uint8_t{0}).put(std::uint8_t{21}).zeros(13);
  f.put(std::uint16_t{0}).put(std::uint16_t{200}).put(std::uint16_t{400}).put(std::uint8_t{0});
  return block(4007 | 2u << 13, ms, f.bytes);
}
Bytes covariance(std::uint32_t ms) {
  Fields f;
  f.put(std::uint8_t{4}).put(std::uint8_t{0}).put(0.01f).put(0.04f).put(0.09f).zeros(28);
  return block(5906, ms, f.bytes);
}
GpsTime at(std::int64_t ms) { return from_gps_week(kWeek, milliseconds(ms)); }

Heard decode(const Bytes& bytes) {
  SeptentrioDecoder decoder({});
  Heard heard = hear(decoder, bytes, 1);
  EXPECT_EQ(heard.bytes(), bytes.size());
  return heard;
}

TEST(Septentrio, SolutionWithItsSigmas) {
  const Heard heard = decode(solution(18'020));
  const auto all = heard.all<InsSolution>();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].time, at(18'020));
  EXPECT_TRUE(all[0].is_good);
  EXPECT_NEAR(all[0].position.latitude, 47.3 * kRadPerDeg, 1e-15);
  EXPECT_EQ(all[0].position.ellipsoidal_height, 450);
  EXPECT_THAT(all[0].velocity_enu, ElementsAre(4, 3, 0.5));
  EXPECT_NEAR(all[0].attitude.heading, 359 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(all[0].attitude.pitch, -2 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(all[0].attitude.roll, 1 * kRadPerDeg, 1e-12);
  ASSERT_TRUE(all[0].sigma.has_value());
  EXPECT_NEAR((*all[0].sigma)[0], 0.02, 1e-8);
  EXPECT_NEAR((*all[0].sigma)[1], 0.01, 1e-8);
  EXPECT_NEAR((*all[0].sigma)[3], 0.04, 1e-8);
  EXPECT_NEAR((*all[0].sigma)[6], 0.1 * kRadPerDeg, 1e-8);
  EXPECT_NEAR((*all[0].sigma)[8], 0.3 * kRadPerDeg, 1e-8);
}

TEST(Septentrio, SubBlocksMayBeMissing) {
  EXPECT_TRUE(decode(solution(18'020, 0, 0x05)).all<InsSolution>().empty());  // no attitude
  const auto without_sigma = decode(solution(18'020, 0, 0x0A)).all<InsSolution>();
  ASSERT_EQ(without_sigma.size(), 1u);
  EXPECT_FALSE(without_sigma[0].sigma.has_value());
  EXPECT_NEAR(without_sigma[0].velocity_enu.x(), 4, 1e-12);
  EXPECT_FALSE(decode(solution(18'020, 3)).all<InsSolution>().at(0).is_good);
}

TEST(Septentrio, FixTakesItsCovariance) {
  const Heard heard = decode(fix(18'000, 4) + covariance(18'000) + fix(19'000, 1) + fix(20'000, 0, 1));
  const auto all = heard.all<GnssFix>();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].type, FixType::RtkFixed);
  EXPECT_EQ(all[0].satellites, 21);
  EXPECT_NEAR(all[0].sigma_enu[0], 0.707, 0.001);  // the first one does not know that a covariance comes
  EXPECT_EQ(all[1].time, at(19'000));
  const auto next = decode(fix(18'000, 4) + covariance(18'000) + fix(19'000, 4) + covariance(19'000)).all<GnssFix>();
  ASSERT_EQ(next.size(), 2u);
  EXPECT_NEAR(next[1].sigma_enu[0], 0.2, 1e-7);
  EXPECT_NEAR(next[1].sigma_enu[1], 0.1, 1e-7);
  EXPECT_NEAR(next[1].sigma_enu[2], 0.3, 1e-7);
}

/// At latitude 0 and longitude 90 deg, east is -x, north is z, and up is y.
Bytes cartesian_fix(std::uint32_t ms, double y = 6378137.0 + 450) {
  Fields f;
  f.put(std::uint8_t{4}).put(std::uint8_t{0}).put(0.0).put(y).put(0.0).put(50.0f).zeros(12).put(0.0f);
  f.put(0.0).put(0.0f).put(std::uint8_t{0}).put(std::uint8_t{0}).put(std::uint8_t{21}).zeros(13);
  f.put(std::uint16_t{0}).put(std::uint16_t{200}).put(std::uint16_t{400}).put(std::uint8_t{0});
  return block(4006 | 2u << 13, ms, f.bytes);
}
Bytes cartesian_covariance(std::uint32_t ms) {
  Fields f;
  f.put(std::uint8_t{4}).put(std::uint8_t{0}).put(0.04f).put(0.09f).put(0.01f).zeros(28);
  return block(5905, ms, f.bytes);
}
Bytes cartesian_solution(std::uint32_t ms) {
  Fields f;
  f.put(std::uint8_t{4}).put(std::uint8_t{0}).put(std::uint16_t{0}).put(std::uint16_t{5});
  f.put(0.0).put(6378137.0 + 450).put(0.0).put(std::uint16_t{3}).put(std::uint16_t{100});
  f.put(std::uint8_t{0}).put(std::uint8_t{0}).put(std::uint16_t{0x1F});
  f.put(0.02f).put(0.03f).put(0.01f).put(359.0f).put(-2.0f).put(1.0f).put(0.3f).put(0.2f).put(0.1f);
  f.put(-4.0f).put(0.5f).put(3.0f).put(0.04f).put(0.05f).put(0.03f);
  return block(4225, ms, f.bytes);
}

TEST(Septentrio, PlacesInTheFrameOfTheEarth) {
  const auto fixes = decode(cartesian_fix(18'000) + cartesian_covariance(18'000) + cartesian_fix(19'000) +
                            cartesian_covariance(19'000) + cartesian_fix(20'000, 100))
                         .all<GnssFix>();
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[1].time, at(19'000));
  EXPECT_EQ(fixes[1].type, FixType::RtkFixed);
  EXPECT_NEAR(fixes[1].position.latitude, 0, 1e-12);
  EXPECT_NEAR(fixes[1].position.longitude, 90 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(fixes[1].position.ellipsoidal_height, 450, 1e-6);
  EXPECT_NEAR(fixes[1].sigma_enu[0], 0.2, 1e-6);
  EXPECT_NEAR(fixes[1].sigma_enu[1], 0.1, 1e-6);
  EXPECT_NEAR(fixes[1].sigma_enu[2], 0.3, 1e-6);

  const Heard heard = decode(cartesian_solution(18'000));
  const auto solutions = heard.all<InsSolution>();
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_EQ(heard.all<TimeLabel>().size(), 1u);
  const InsSolution& one = solutions[0];
  EXPECT_NEAR(one.position.ellipsoidal_height, 450, 1e-6);
  EXPECT_NEAR((one.velocity_enu - Eigen::Vector3d(4, 3, 0.5)).norm(), 0, 1e-9);
  EXPECT_NEAR(one.attitude.roll, 1 * kRadPerDeg, 1e-9);
  ASSERT_TRUE(one.sigma);
  for (const auto& [i, sigma] : std::vector<std::pair<std::size_t, double>>{
           {0, 0.02}, {1, 0.01}, {2, 0.03}, {3, 0.04}, {4, 0.03}, {5, 0.05}, {8, 0.3 * kRadPerDeg}})
    EXPECT_NEAR((*one.sigma)[i], sigma, 1e-6) << i;
}

TEST(Septentrio, ACovarianceMayEndEarly) {
  for (std::size_t size = 14; size <= 42; size += 4) {
    Fields f;
    f.put(std::uint8_t{4}).put(std::uint8_t{0}).put(0.04f).put(0.09f).put(0.01f).zeros(28);
    f.bytes.resize(size);
    EXPECT_EQ(decode(block(5905, 18'000, f.bytes) + cartesian_fix(18'000) + block(5905, 18'000, f.bytes))
                  .all<GnssFix>()
                  .size(),
              1u)
        << size;
  }
}

TEST(Septentrio, AMomentIsUsedOnceThoughTwoBlocksHaveIt) {
  const Heard heard = decode(fix(18'000, 4) + cartesian_fix(18'000) + cartesian_fix(19'000) + fix(19'000, 4) +
                             solution(18'000) + cartesian_solution(18'000));
  EXPECT_EQ(heard.all<GnssFix>().size(), 2u);
  EXPECT_EQ(heard.all<InsSolution>().size(), 1u);
}

TEST(Septentrio, MarksAreOnTheScaleOfGnss) {
  const Heard heard = decode(receiver_time(18'000, 7) + event(18'123, 0.000456789f, 0.0001));
  const auto all = heard.all<EventMark>();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NEAR(to_seconds(all[0].time - at(18'123)), 0.000356789, 1e-10);
  EXPECT_EQ(all[0].input, 2);
  EXPECT_TRUE(all[0].is_valid);
  EXPECT_TRUE(heard.faults().empty());
}

TEST(Septentrio, ARunawayClockIsToldAndNotTrusted) {
  // Indoors: the time of the week runs from an old value, hours beside the true one; no solution, no clock bias.
  const Heard heard = decode(receiver_time(9'000'000, 3) + event(9'000'123, 0, -2e10) + fix(9'000'000, 0, 1) +
                             event(0xFFFFFFFF, 0, -2e10, 0xFFFF));
  EXPECT_TRUE(heard.all<TimeLabel>().empty());
  EXPECT_TRUE(heard.all<GnssFix>().empty());
  ASSERT_EQ(heard.all<EventMark>().size(), 1u);
  EXPECT_FALSE(heard.all<EventMark>()[0].is_valid);
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime, FaultKind::NoTime, FaultKind::NoTime));
}

TEST(Septentrio, LabelsAreOneASecondWithTheLeapSeconds) {
  const Heard heard = decode(receiver_time(18'000, 7) + solution(18'020) + solution(18'980) + solution(19'000));
  const auto labels = heard.all<TimeLabel>();
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_EQ(labels[0].second, at(18'000));
  EXPECT_EQ(labels[0].utc_offset, std::chrono::seconds(18));
  EXPECT_EQ(labels[1].second, at(19'000));
}

TEST(Septentrio, RepliesAreReadBetweenBlocks) {
  const Heard heard =
      decode(bytes_of("$R: setSBFOutput, Stream1, COM1, INSNavGeod, msec20\r\n  SBFOutput, Stream1\r\nCOM1>") +
             solution(18'020) + bytes_of("$R? setSBFOutput: Invalid command!\r\nCOM1>"));
  EXPECT_EQ(heard.counts.malformed_bytes, 0u);
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::Refused));
  EXPECT_EQ(heard.all<InsSolution>().size(), 1u);
}

TEST(Septentrio, AsksForItsBlocks) {
  const SeptentrioLogs logs{.connection = "IPS1", .raw_period_ms = 0};
  EXPECT_TRUE(logs.validate().empty());
  EXPECT_EQ(logs.dialogue(),
            "setSBFOutput, Stream1, IPS1, INSNavGeod, msec20\r\n"
            "setSBFOutput, Stream2, IPS1, PVTGeodetic+PosCovGeodetic+ReceiverTime, sec1\r\n"
            "setSBFOutput, Stream3, IPS1, ExtEvent, OnChange\r\n");
  EXPECT_FALSE((SeptentrioLogs{.connection = "COM1", .period_ms = 30}).validate().empty());
}

}  // namespace
}  // namespace hueline::drivers
