#include "drivers/velodyne/velodyne_position.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/velodyne/velodyne_packets.hpp"

namespace hueline::drivers {
namespace {

using test::nmea_sentence;
using test::only;
using test::packet_of;
using test::velodyne_position;

std::string rmc(const std::string& time, const std::string& date, char status = 'A') {
  return nmea_sentence("GPRMC," + time + "," + status + ",3649.74,N,00224.45,W,0.03,212.5," + date + ",0.0,E,A");
}

std::vector<Measurement> decode(VelodyneDecoder& decoder, std::uint32_t stamp_us, unsigned pps, const std::string& nmea,
                                std::int64_t received_ns = 0) {
  std::vector<Measurement> out;
  decoder.decode(packet_of(velodyne_position(stamp_us, pps, nmea), received_ns), out);
  return out;
}

TEST(Rmc, NamesTheUtcSecondOfAPublishedSentence) {
  // The sentence of the HDL-32E manual's appendix B, without its blanks and with a new checksum.
  const Result<RmcSentence> r =
      decode_rmc(nmea_sentence("GPRMC,214042,A,3708.3087,N,12139.5146,W,000.0,000.0,160311,014.8,E,A"));
  ASSERT_TRUE(r.ok()) << r.error().message;
  EXPECT_TRUE(r->is_active);
  EXPECT_EQ(r->utc, (UtcTime{2011, 3, 16, 21, 40, 42, 0}));
}

TEST(Rmc, ReadsFractionsOtherTalkersVoidStatusAndTheLastCentury) {
  const Result<RmcSentence> r = decode_rmc(nmea_sentence("GNRMC,235959.25,V,,,,,,,311299,,"));
  ASSERT_TRUE(r.ok()) << r.error().message;
  EXPECT_FALSE(r->is_active);
  EXPECT_EQ(r->utc, (UtcTime{1999, 12, 31, 23, 59, 59, 250'000'000}));
}

TEST(Rmc, RefusesWhatItCannotTrust) {
  const std::string good = rmc("081802.00", "210116");
  ASSERT_TRUE(decode_rmc(good).ok());
  for (std::size_t i = 0; i < good.find('*'); ++i) {
    std::string flipped = good;
    flipped[i] = static_cast<char>(flipped[i] ^ 1);
    EXPECT_FALSE(decode_rmc(flipped).ok()) << flipped;
  }
  for (std::size_t n = 0; n < good.find('*') + 3; ++n) EXPECT_FALSE(decode_rmc(good.substr(0, n)).ok());
  EXPECT_EQ(decode_rmc(rmc("246000", "210116")).error().code, ErrorCode::Malformed);
  EXPECT_EQ(decode_rmc(rmc("081802", "320116")).error().code, ErrorCode::Malformed);
  EXPECT_EQ(decode_rmc(rmc("081802", "")).error().code, ErrorCode::Malformed);
  EXPECT_EQ(decode_rmc(rmc("", "210116")).error().code, ErrorCode::Malformed);
  EXPECT_EQ(decode_rmc(nmea_sentence("GPGGA,081802,1")).error().code, ErrorCode::Unsupported);
  EXPECT_EQ(decode_rmc(nmea_sentence("GPRMC,081802,A")).error().code, ErrorCode::Malformed);
}

TEST(VelodynePosition, ALateSentenceDoesNotLabelTheNewEdgeWithTheOldSecond) {
  const GpsTime second = *from_utc({2016, 1, 21, 8, 18, 2, 0});
  // The counter is at 18 min 2.4 s with the sentence of that second; then at 18 min 3.1 s, still with the old sentence.
  VelodyneDecoder decoder({});
  auto labels = only<TimeLabel>(decode(decoder, 1'082'400'000, 2, rmc("081802.00", "210116")));
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_EQ(labels[0].second, second);
  EXPECT_TRUE(labels[0].is_valid);
  labels = only<TimeLabel>(decode(decoder, 1'083'100'000, 2, rmc("081802.00", "210116"), 700'000'000));
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_EQ(labels[0].second, second + std::chrono::seconds(1));
  EXPECT_TRUE(labels[0].is_valid);
  // The same second again, now with its own sentence, gives no further label.
  EXPECT_TRUE(only<TimeLabel>(decode(decoder, 1'083'700'000, 2, rmc("081803.00", "210116"), 1'300'000'000)).empty());
}

TEST(VelodynePosition, TheHourTheDayAndTheYearMayTurnBetweenSentenceAndEdge) {
  VelodyneDecoder decoder({});
  const auto labels = only<TimeLabel>(decode(decoder, 200'000, 2, rmc("235959.00", "311216")));
  ASSERT_EQ(labels.size(), 1u);
  // 2016 ended with a leap second, before which the sentence of 23:59:59 came: the edge after it is 23:59:60.
  EXPECT_EQ(labels[0].second, *from_utc({2016, 12, 31, 23, 59, 60, 0}));
  VelodyneDecoder other({});
  EXPECT_EQ(only<TimeLabel>(decode(other, 200'000, 2, rmc("235959.00", "311217"))).at(0).second,
            *from_utc({2018, 1, 1, 0, 0, 0, 0}));
}

TEST(VelodynePosition, LabelsAreValidOnlyWithALockAndAnActiveFix) {
  const auto is_valid = [](unsigned pps, char status) {
    VelodyneDecoder decoder({});
    return only<TimeLabel>(decode(decoder, 1'082'400'000, pps, rmc("081802.00", "210116", status))).at(0).is_valid;
  };
  EXPECT_TRUE(is_valid(2, 'A'));
  EXPECT_FALSE(is_valid(2, 'V'));
  EXPECT_FALSE(is_valid(1, 'A'));
  EXPECT_FALSE(is_valid(0, 'A'));
  EXPECT_FALSE(is_valid(3, 'A'));
}

TEST(VelodynePosition, NoLabelNearTheEdge) {
  VelodyneDecoder decoder({});
  EXPECT_TRUE(only<TimeLabel>(decode(decoder, 1'082'000'010, 2, rmc("081801.00", "210116"))).empty());
  EXPECT_TRUE(only<TimeLabel>(decode(decoder, 1'082'999'990, 2, rmc("081802.00", "210116"))).empty());
}

TEST(VelodynePosition, ACounterThatDisagreesWithTheSentenceIsAConflict) {
  VelodyneDecoder decoder({});
  const auto out = decode(decoder, 1'100'400'000, 2, rmc("081802.00", "210116"));
  const auto labels = only<TimeLabel>(out);
  ASSERT_EQ(labels.size(), 1u);
  EXPECT_FALSE(labels[0].is_valid);
  const auto faults = only<Fault>(out);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].kind, FaultKind::LabelConflict);
}

TEST(VelodynePosition, StatusTellsCounterLockAndSentence) {
  VelodyneDecoder decoder({});
  auto status = only<LaserStatus>(decode(decoder, 42, 1, "")).at(0);
  EXPECT_EQ(test::counter(*status.time), nanoseconds(42'000));
  EXPECT_EQ(status.clock, SyncState::Acquiring);
  EXPECT_EQ(status.words, "synchronising to PPS, no NMEA sentence");
  status = only<LaserStatus>(decode(decoder, 42, 9, rmc("081802.00", "210116"))).at(0);
  EXPECT_EQ(status.clock, SyncState::Unlocked);
  EXPECT_EQ(status.words, "PPS status 9, RMC valid");
  // A broken sentence: the status is used, and the sentence is counted as malformed.
  std::string broken = rmc("081802.00", "210116");
  broken[10] = '?';
  const auto out = decode(decoder, 43, 2, broken, 5'000'000'000);
  EXPECT_EQ(only<LaserStatus>(out).size(), 1u);
  EXPECT_EQ(only<Fault>(out).at(0).kind, FaultKind::Malformed);
  EXPECT_EQ(decoder.counts().decoded_bytes + decoder.counts().malformed_bytes, 3u * 512);
}

}  // namespace
}  // namespace hueline::drivers
