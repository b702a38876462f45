// NMEA 0183 sentences, made here by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/nmea/nmea_decoder.hpp"
#include "tests/drivers/stream/stream_bytes.hpp"

namespace hueline::drivers {
namespace {

using namespace test;
using testing::ElementsAre;

Heard decode(const Bytes& bytes) {
  NmeaDecoder decoder({});
  Heard heard = hear(decoder, bytes, 1);
  EXPECT_EQ(heard.bytes(), bytes.size());
  return heard;
}
GpsTime utc(int day, int hour, int minute, int second, int ms = 0) {
  return *from_utc({2026, 3, day, hour, minute, second, ms * 1'000'000});
}

TEST(Nmea, JoinsTheSentencesOfAnEpoch) {
  const Bytes epoch = nmea("GNGGA,120000.00,4718.0000,N,00830.0000,E,4,12,0.8,400.123,M,50.000,M,1.0,0001") +
                      nmea("GNRMC,120000.00,A,4718.0,N,00830.0,E,10.0,90.0,010326,,,R") +
                      nmea("GNGST,120000.00,1,1,1,0,0.010,0.020,0.030");
  const Heard heard = decode(epoch);
  const auto fixes = heard.all<GnssFix>();
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].time, utc(1, 12, 0, 0));
  EXPECT_EQ(fixes[0].type, FixType::RtkFixed);
  EXPECT_NEAR(fixes[0].position.latitude, 47.3 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(fixes[0].position.longitude, 8.5 * kRadPerDeg, 1e-15);
  EXPECT_DOUBLE_EQ(fixes[0].position.ellipsoidal_height, 450.123);
  EXPECT_EQ(fixes[0].satellites, 12);
  EXPECT_THAT(fixes[0].sigma_enu, ElementsAre(0.02, 0.01, 0.03));
  ASSERT_EQ(heard.all<TimeLabel>().size(), 1u);
  EXPECT_EQ(heard.all<TimeLabel>()[0].second, utc(1, 12, 0, 0));
}

/// As a plotter writes the date in ZDA, with and without RMC beside it.
TEST(Nmea, AYearOfTwoDigitsInZdaIsThatOfRmc) {
  const Bytes zda = nmea("GPZDA,120000,01,03,26,-02,00");
  const Bytes rmc = nmea("GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,0.7,E,A");
  const Bytes gga = nmea("GPGGA,120000,4718.0,N,00830.0,E,1,08,1.1,400,M,50,M,,");
  for (const Bytes& log : {gga + zda, gga + rmc + zda}) {
    const Heard heard = decode(log);
    EXPECT_TRUE(heard.all<Fault>().empty());
    ASSERT_EQ(heard.all<GnssFix>().size(), 1u);
    EXPECT_EQ(heard.all<GnssFix>()[0].time, utc(1, 12, 0, 0));
    ASSERT_EQ(heard.all<TimeLabel>().size(), 1u);
    EXPECT_EQ(heard.all<TimeLabel>()[0].second, utc(1, 12, 0, 0));
  }
}

/// As terminals and loggers write them.
TEST(Nmea, SentencesMayStandBehindATimeOrInQuotationMarks) {
  const Bytes gga = nmea("GNGGA,120000.00,4718.0000,N,00830.0000,E,4,12,0.8,400.123,M,50.000,M,1.0,0001"),
              rmc = nmea("GNRMC,120000.00,A,4718.0,N,00830.0,E,10.0,90.0,010326,,,R");
  const auto stripped = [](Bytes sentence) {
    sentence.resize(sentence.size() - 2);
    return sentence;
  };
  for (const Bytes& log : {bytes_of("2026-03-01 12:00:00.123 ") + gga + bytes_of("2026-03-01 12:00:00.125 ") + rmc,
                           bytes_of("1772366400.1,\"") + stripped(gga) + bytes_of("\"\n1772366400.2,\"") +
                               stripped(rmc) + bytes_of("\"\n"),
                           bytes_of("costs $5 or $A, ") + gga + bytes_of("$ ") + rmc}) {
    const Heard heard = decode(log);
    EXPECT_EQ(heard.all<GnssFix>().size(), 1u);
    EXPECT_EQ(heard.all<TimeLabel>().size(), 1u);
  }
  const Heard comment = decode(bytes_of("# such as ") + gga + rmc);
  EXPECT_TRUE(comment.all<GnssFix>().empty());
  EXPECT_EQ(comment.counts.messages.at("text"), 1u);
}

TEST(Nmea, OfSeveralTalkersTheCombinedSolutionIsUsed) {
  const auto gga = [](const std::string& talker, int second, int quality, const char* minutes) {
    return nmea(talker + "GGA,12000" + std::to_string(second) + ".00,47" + minutes + ",N,00830.0000,E," +
                std::to_string(quality) + ",12,0.8,400,M,50,M,1.0,0001");
  };
  const auto rmc = [](int second) {
    return nmea("GNRMC,12000" + std::to_string(second) + ".00,A,4718.0,N,00830.0,E,10.0,90.0,010326,,,R");
  };
  const auto latitudes = [](const Bytes& bytes) {
    std::vector<long> out;
    for (const GnssFix& fix : decode(bytes).all<GnssFix>())
      out.push_back(std::lround(fix.position.latitude * kDegPerRad * 60000));
    return out;
  };
  Bytes last, first, none;
  for (int second = 0; second < 3; ++second) {
    const Bytes own = gga("GN", second, 4, "18.000"), gps = gga("GP", second, 2, "18.010"),
                beidou = gga("BD", second, 1, "18.020");
    last = last + rmc(second) + gps + beidou + own;
    first = first + own + gps + beidou + rmc(second);
    none = none + gps + beidou + rmc(second);
  }
  EXPECT_THAT(latitudes(last), ElementsAre(2838000, 2838000, 2838000));
  EXPECT_THAT(latitudes(first), ElementsAre(2838000, 2838000, 2838000));
  EXPECT_THAT(latitudes(none), ElementsAre(2838010, 2838010, 2838010));
}

TEST(Nmea, AFixWithoutADateHasNoTime) {
  const Heard heard = decode(nmea("GPGGA,120000,4718.0,N,00830.0,E,1,8,1.0,400,M,50,M,,"));
  EXPECT_TRUE(heard.all<GnssFix>().empty());
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::NoTime));
}

TEST(Nmea, MidnightBetweenPositionAndDate) {
  const auto gga = [](const char* time) {
    return nmea(std::string("GPGGA,") + time + ",4718.0,N,00830.0,E,1,8,1.0,400,M,50,M,,");
  };
  const Heard heard = decode(nmea("GPZDA,235959.00,01,03,2026,00,00") + gga("235959.00") + gga("235959.50") +
                             gga("000000.00") + gga("000000.50") + nmea("GPZDA,000001.00,02,03,2026,00,00"));
  std::vector<GpsTime> times;
  for (const GnssFix& fix : heard.all<GnssFix>()) times.push_back(fix.time);
  EXPECT_THAT(times, ElementsAre(utc(1, 23, 59, 59), utc(1, 23, 59, 59, 500), utc(2, 0, 0, 0), utc(2, 0, 0, 0, 500)));
  EXPECT_TRUE(heard.faults().empty());
}

TEST(Nmea, AHeightWithoutTheGeoidIsNotTrusted) {
  const Heard heard = decode(nmea("GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,,,A") +
                             nmea("GPGGA,120000,4718.0,N,00830.0,E,1,8,1.0,400,M,,M,,"));
  EXPECT_GE(heard.all<GnssFix>().at(0).sigma_enu[2], 100);
  EXPECT_FALSE(heard.all<GnssFix>().at(0).has_height);
  // A poor height is one.
  const Heard poor = decode(nmea("GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,,,A") +
                            nmea("GPGGA,120000,4718.0,N,00830.0,E,1,4,17.3,400,M,50,M,,"));
  EXPECT_GT(poor.all<GnssFix>().at(0).sigma_enu[2], 100);
  EXPECT_TRUE(poor.all<GnssFix>().at(0).has_height);
}

/// A receiver that has never had a fix names GPS's first day.
TEST(Nmea, YearsBefore1980AreOfTheNextCentury) {
  const auto year_of = [](const char* year) {
    const Heard heard = decode(nmea(std::string("GPRMC,120000,A,4718.0,N,00830.0,E,0,0,0601") + year + ",,,A") +
                               nmea("GPGGA,120000,4718.0,N,00830.0,E,1,8,1.0,400,M,50,M,,"));
    return to_utc(heard.all<GnssFix>().at(0).time).year;
  };
  EXPECT_EQ(year_of("80"), 1980);
  EXPECT_EQ(year_of("99"), 1999);
  EXPECT_EQ(year_of("00"), 2000);
  EXPECT_EQ(year_of("79"), 2079);
}

TEST(Nmea, PositionsThatDoNotSayHowGoodTheyAreAreTold) {
  const Bytes rmc = nmea("GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,,,A"),
              gll = nmea("GPGLL,4718.0,N,00830.0,E,120000,A"),
              gga = nmea("GPGGA,120000,4718.0,N,00830.0,E,1,8,1.0,400,M,50,M,,");
  EXPECT_THAT(decode(rmc).faults(), ElementsAre(FaultKind::Implausible));
  EXPECT_THAT(decode(gll + gll).faults(), ElementsAre(FaultKind::Implausible));
  EXPECT_THAT(decode(gll + gga + rmc).faults(), ElementsAre());
  EXPECT_THAT(decode(nmea("GPRMC,120000,V,4718.0,N,00830.0,E,0,0,010326,,,N")).faults(), ElementsAre());
  Bytes many;
  for (int i = 0; i < 50; ++i) many = many + gll;
  EXPECT_THAT(decode(many).faults(), ElementsAre(FaultKind::Implausible)) << "told once, and before the stream ends";
}

TEST(Nmea, DatesThatContradictMakeNoLabel) {
  const Heard heard =
      decode(nmea("GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,,,A") + nmea("GPZDA,120000,15,07,2006,00,00") +
             nmea("GPGGA,120000,4718.0,N,00830.0,E,1,8,1.0,400,M,50,M,,"));
  EXPECT_THAT(heard.faults(), ElementsAre(FaultKind::LabelConflict));
  EXPECT_TRUE(heard.all<TimeLabel>().empty());
}

TEST(Nmea, AnInvalidReceiverMakesNoLabel) {
  EXPECT_TRUE(decode(nmea("GPRMC,120000,V,,,,,,,010326,,,N")).all<TimeLabel>().empty());
}

TEST(Nmea, AttitudeOfPashrMakesASolution) {
  const Heard heard = decode(nmea("GPRMC,120000.000,A,4718.0,N,00830.0,E,10.0,90.0,010326,,,R") +
                             nmea("GPGGA,120000.000,4718.0,N,00830.0,E,5,8,1.0,400,M,50,M,,") +
                             nmea("PASHR,120000.000,359.00,T,+1.00,-2.00,+0.00,0.010,0.020,0.030,2,1"));
  const auto solutions = heard.all<InsSolution>();
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_TRUE(solutions[0].is_good);
  EXPECT_NEAR(solutions[0].attitude.heading, 359 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[0].attitude.roll, 1 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[0].attitude.pitch, -2 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(solutions[0].velocity_enu.x(), 18520.0 / 3600, 1e-12);
  EXPECT_NEAR(solutions[0].velocity_enu.y(), 0, 1e-12);
  EXPECT_NEAR((*solutions[0].sigma)[8], 0.03 * kRadPerDeg, 1e-12);
}

TEST(Nmea, SentencesThatAreWrongAreNotUsed) {
  const Heard heard = decode(nmea("GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,,,A") +
                             nmea("GPGGA,120000,4799.0,N,00830.0,E,1,8,1.0,400,M,50,M,,") +  // 99 minutes
                             nmea("GPGGA,126000,4718.0,N,00830.0,E,1,8,1.0,400,M,50,M,,") +  // minute 60
                             nmea("GPGGA,120000,9130.0,N,00830.0,E,1,8,1.0,400,M,50,M,,"));
  EXPECT_TRUE(heard.all<GnssFix>().empty());
}

}  // namespace
}  // namespace hueline::drivers
