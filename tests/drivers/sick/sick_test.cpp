// CoLa telegrams in both forms, made here by hand after captures of an LMS511 and an LMS111.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include "drivers/sick/sick_decoder.hpp"
#include "drivers/sick/sick_telegram.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;

template <class T>
Bytes big(T value) {
  Bytes out = Fields{}.put(value).bytes;
  std::reverse(out.begin(), out.end());
  return out;
}
Bytes cola_b(const std::string& head, const Bytes& values) {
  const Bytes telegram = bytes_of(head) + values;
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : telegram) sum = static_cast<std::uint8_t>(sum ^ byte);
  return Bytes{2, 2, 2, 2} + big(static_cast<std::uint32_t>(telegram.size())) + telegram + Bytes{sum};
}
Bytes cola_a(const std::string& telegram) { return Bytes{2} + bytes_of(telegram) + Bytes{3}; }

/// A scan of four firings from -5 deg on in steps of 45 deg, at 25 Hz.
struct Scan {
  std::uint16_t number = 100;
  std::uint32_t since_us = 5'000'000;
  std::uint16_t layer = 0;
  std::uint32_t frequency = 2500;
  std::uint16_t step = 16'667;  // 45 deg does not fit into 16 bits of 0.0001 deg: 1.6667 deg is used
  Bytes clock = big(std::uint16_t{2026}) + Bytes{3, 1, 12, 30, 15} + big(std::uint32_t{250'000});

  Bytes channel(const char* name, float scale, bool is_byte, std::initializer_list<std::uint16_t> values) const {
    Bytes out = bytes_of(name) + big(scale) + big(0.0f) + big(std::int32_t{-50'000}) + big(step) +
                big(static_cast<std::uint16_t>(values.size()));
    for (const std::uint16_t value : values)
      out = out + (is_byte ? Bytes{static_cast<std::uint8_t>(value)} : big(value));
    return out;
  }
  Bytes values() const {
    return big(std::uint16_t{1}) + big(std::uint16_t{1}) + big(std::uint32_t{0x01145856}) + Bytes{0, 0} + big(number) +
           big(number) + big(since_us) + big(since_us + 40'000) + Bytes{0, 0, 0, 0} + big(layer) + big(frequency) +
           big(std::uint32_t{540}) + big(std::uint16_t{0}) + big(std::uint16_t{2}) +
           channel("DIST1", 2.0f, false, {1000, 0, 3000, 50}) + channel("DIST2", 2.0f, false, {900, 0, 0, 0}) +
           big(std::uint16_t{1}) + channel("RSSI1", 1.0f, true, {200, 0, 100, 5}) + big(std::uint16_t{0}) +
           big(std::uint16_t{0}) + big(std::uint16_t{0}) +
           big(std::uint16_t{clock.empty() ? std::uint16_t{0} : std::uint16_t{1}}) + clock + big(std::uint16_t{0});
  }
  Bytes binary() const { return cola_b("sSN LMDscandata ", values()); }
};
Heard decode(const Bytes& bytes, SickDecoder::Config config = {}, std::size_t chunk = 4096) {
  SickDecoder decoder(config);
  Heard heard = hear(decoder, bytes, chunk);
  EXPECT_EQ(heard.bytes(), bytes.size());
  return heard;
}
constexpr double kRad = std::numbers::pi / 180;

/// 54000 measurements a second at 50 turns a second are 1080 a turn.
TEST(Sick, TheStepOfTheAngleIsThatOfTheTurnIfTheTelegramRoundsIt) {
  const auto step_of = [](std::uint16_t told, std::uint32_t frequency) {
    const Scan scan{.frequency = frequency, .step = told};
    const Bytes bytes = bytes_of("sSN LMDscandata ") + scan.values();
    const auto telegram = read_sick_telegram(std::as_bytes(std::span(bytes)), false);
    return read_sick_scan(*telegram)->channels.at(0).step / kRad;
  };
  EXPECT_NEAR(step_of(3333, 5000), 1.0 / 3, 1e-12);
  EXPECT_NEAR(step_of(static_cast<std::uint16_t>(-3333), 5000), -1.0 / 3, 1e-12);
  EXPECT_NEAR(step_of(1667, 2500), 1.0 / 6, 1e-12);
  EXPECT_NEAR(step_of(5000, 7500), 0.5, 1e-12);
  EXPECT_NEAR(step_of(5000, 5000), 0.5, 1e-12) << "another step than that of the frequencies is what the telegram says";
  EXPECT_NEAR(step_of(3333, 4321), 0.3333, 1e-12) << "no whole number of steps";
  EXPECT_NEAR(step_of(3333, 0), 0.3333, 1e-12);
}

TEST(Sick, AScanInColaB) {
  for (const std::size_t chunk : {1u, 7u, 4096u}) {
    const Heard heard = decode(Scan{}.binary(), {}, chunk);
    const auto scans = heard.all<LaserBatch>();
    ASSERT_EQ(scans.size(), 1u);
    EXPECT_THAT(heard.faults(), ElementsAre());
    const auto& returns = scans[0].returns;
    ASSERT_EQ(returns.size(), 4u);  // two echoes of the first firing; no echo of the second; 0.1 m is not too near
    EXPECT_NEAR(returns[0].range_m, 1.8, 1e-6);
    EXPECT_EQ(returns[0].return_number, 1);
    EXPECT_EQ(returns[0].return_count, 2);
    EXPECT_NEAR(returns[1].range_m, 2.0, 1e-6);
    EXPECT_EQ(returns[1].return_number, 2);
    EXPECT_EQ(returns[1].reflectivity, 200);
    EXPECT_NEAR(returns[1].x, 2 * std::cos(-5 * kRad), 1e-6);
    EXPECT_NEAR(returns[1].y, 2 * std::sin(-5 * kRad), 1e-6);
    EXPECT_NEAR(returns[1].azimuth, 355 * kRad, 1e-6);
    EXPECT_NEAR(returns[2].range_m, 6.0, 1e-6);
    EXPECT_NEAR(returns[2].azimuth, (2 * 1.6667 + 355) * kRad, 1e-5);
    EXPECT_NEAR(returns[2].time_offset_ns, 2 * 1.6667 / 360 / 25 * 1e9, 2);
    const auto& stamp = std::get<LaserCounter>(scans[0].time);
    EXPECT_NEAR(static_cast<double>(stamp.value.count()), 5e9 + 85.0 / 360 / 25 * 1e9, 2) << "from -90 deg to -5 deg";
    EXPECT_EQ(stamp.period, std::chrono::microseconds(std::int64_t{1} << 32));
  }
}

TEST(Sick, AScanInColaA) {
  // The head and the first values of a real telegram of an LMS111.
  const Heard heard =
      decode(cola_a("sSN LMDscandata 1 1 D6FF21 0 0 286B 3C84 EE4D4845 EE4DA2ED 0 0 7 0 0 1388 168 0 1 DIST1 3F800000 "
                    "00000000 FFF92230 "
                    "1388 4 112 105 0 +259 0 0 0 0 0 0"));
  const auto scans = heard.all<LaserBatch>();
  ASSERT_EQ(scans.size(), 1u) << (heard.all<Fault>().empty() ? "" : heard.all<Fault>()[0].detail);
  ASSERT_EQ(scans[0].returns.size(), 3u);
  EXPECT_NEAR(scans[0].returns[0].range_m, 0.274, 1e-6);
  EXPECT_NEAR(scans[0].returns[0].azimuth, (360 - 45) * kRad, 1e-6);
  EXPECT_NEAR(scans[0].returns[2].range_m, 0.259, 1e-6);
  EXPECT_NEAR(scans[0].returns[2].azimuth, (360 - 45 + 3 * 0.5) * kRad, 1e-5);
  EXPECT_NEAR(static_cast<double>(std::get<LaserCounter>(scans[0].time).value.count()),
              0xEE4D4845 * 1e3 + 45.0 / 360 / 50 * 1e9, 2);
}

TEST(Sick, TheClockOfTheScannerIsUsedIfTheRigSaysSo) {
  SickDecoder::Config utc;
  utc.clock = SickDecoder::Clock::Utc;
  Heard heard = decode(Scan{}.binary(), utc);
  ASSERT_EQ(heard.all<LaserBatch>().size(), 1u);
  // 2026-03-01 12:30:15.25 UTC, and the turn from -90 deg to -5 deg.
  EXPECT_NEAR(static_cast<double>(std::get<UnixTime>(heard.all<LaserBatch>()[0].time).time_since_epoch().count() -
                                  1'772'368'215'250'000'000),
              85.0 / 360 / 25 * 1e9, 2);
  Scan since_1970;
  since_1970.clock = big(std::uint16_t{1970}) + Bytes{1, 1, 3, 31, 30} + big(std::uint32_t{0});
  heard = decode(since_1970.binary(), utc);
  EXPECT_TRUE(heard.all<LaserBatch>().empty());
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime));
}

TEST(Sick, GapsAndRepeatsAreTold) {
  Bytes stream;
  for (const int number : {65'534, 65'535, 0, 3, 3, 4}) {
    Scan scan;
    scan.number = static_cast<std::uint16_t>(number);
    stream = stream + scan.binary();
  }
  const Heard heard = decode(stream);
  EXPECT_EQ(heard.all<LaserBatch>().size(), 5u);
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::Lost, FaultKind::Spurious));
  EXPECT_EQ(heard.all<Fault>()[0].count, 2u);
}

TEST(Sick, WhatTheScannerRefusesIsTold) {
  const Heard heard = decode(cola_b("sAN SetAccessMode ", {0}) + cola_b("sWA LMDscandatacfg ", {}) +
                             cola_b("sFA", {0, 3}) + cola_a("sFA 6") + cola_a("sAN Run 1") + cola_a("sAN Run 0"));
  EXPECT_THAT(heard.faults(),
              ElementsAre(FaultKind::Refused, FaultKind::Refused, FaultKind::Refused, FaultKind::Refused));
  EXPECT_THAT(heard.all<Fault>()[0].detail, HasSubstr("SetAccessMode"));
  EXPECT_THAT(heard.all<Fault>()[1].detail, HasSubstr("no such variable"));
}

TEST(Sick, BrokenTelegramsAreTold) {
  Scan layered;
  layered.layer = 250;
  EXPECT_THAT(decode(layered.binary()).faults(), ElementsAre(FaultKind::WrongDevice));
  Scan still;
  still.frequency = 0;
  EXPECT_THAT(decode(still.binary()).faults(), ElementsAre(FaultKind::Malformed));
  // Cut at every place, with the right length and check sum.
  const Bytes values = Scan{}.values();
  for (std::size_t size = 0; size < values.size(); ++size) {
    const Heard heard =
        decode(cola_b("sSN LMDscandata ", Bytes(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(size))));
    EXPECT_LE(heard.all<LaserBatch>().size(), 1u);
  }
  // A wrong check sum, and what follows is read.
  Bytes wrong = Scan{}.binary();
  wrong[40] ^= 1;
  const Heard heard = decode(wrong + Scan{}.binary());
  EXPECT_EQ(heard.all<LaserBatch>().size(), 1u);
  EXPECT_EQ(heard.counts.malformed_messages, 1u);
}

TEST(Sick, TheSetUpIsWhatACaptureOfTheMakersProgramShows) {
  SickOutput binary;
  const std::string said = binary.dialogue();
  const auto has = [&](const Bytes& telegram) {
    return said.find(std::string(telegram.begin(), telegram.end())) != said.npos;
  };
  EXPECT_TRUE(has(cola_b("sMN SetAccessMode ", {3, 0xF4, 0x72, 0x47, 0x44})));
  EXPECT_TRUE(has(cola_b("sWN LMDscandatacfg ", {1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1})));
  EXPECT_TRUE(has(cola_b("sMN Run", {})));
  EXPECT_TRUE(has(cola_b("sEN LMDscandata ", {1})));
  SickOutput text;
  text.form = SickOutput::Form::ColaA;
  text.echoes = SickOutput::Echoes::All;
  EXPECT_THAT(text.dialogue(), HasSubstr("\x02sMN SetAccessMode 03 F4724744\x03\x02sWN FREchoFilter 1\x03"));
  EXPECT_THAT(text.dialogue(), HasSubstr("\x02sEN LMDscandata 1\x03"));
}

TEST(Sick, WrongKeysAreRefused) {
  SickDecoder::Config config;
  config.max_range_m = 0.05;
  EXPECT_THAT(config.validate().text(), HasSubstr("max_range_m is 0.05"));
  config = {};
  config.angle_end = config.angle_begin;
  EXPECT_THAT(config.validate().text(), HasSubstr("angle_end_deg"));
}

}  // namespace
}  // namespace hueline::drivers
