#include "sim/wire/novatel_encode.hpp"

#include <gtest/gtest.h>

#include <map>

#include "tests/sim/recorded.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::sim {
namespace {

using test::load;
using Message = std::vector<std::byte>;

/// Reads fields one after the other.
class Fields {
 public:
  Fields(const Message& message, std::size_t at) : message_(message), at_(at) {}
  template <class... T>
  void into(T&... values) {
    ((values = load<T>(message_, at_), at_ += sizeof(T)), ...);
  }

 private:
  const Message& message_;
  std::size_t at_;
};

NovatelHeader parse_header(const Message& m) {
  NovatelHeader h;
  if (m[2] == std::byte{0x13}) {
    Fields(m, 6).into(h.week, h.milliseconds);
  } else {
    h.port = load<std::uint8_t>(m, 7);
    Fields(m, 10).into(h.sequence, h.idle_time, h.time_status, h.week, h.milliseconds, h.receiver_status, h.reserved,
                       h.software_version);
  }
  return h;
}

void parse_sigma(Fields& in, StdevFields& s) {
  in.into(s.latitude_m, s.longitude_m, s.height_m, s.velocity_north, s.velocity_east, s.velocity_up, s.roll_deg,
          s.pitch_deg, s.azimuth_deg, s.extended_status, s.time_since_update);
}

Message encode_again(const Message& m) {
  const NovatelHeader header = parse_header(m);
  const std::size_t body = m[2] == std::byte{0x13} ? 12 : 28;
  Fields in(m, body);
  switch (const auto id = static_cast<NovatelId>(load<std::uint16_t>(m, 4))) {
    case NovatelId::Inspvas: {
      PvaFields f;
      in.into(f.week, f.seconds, f.latitude_deg, f.longitude_deg, f.ellipsoidal_height_m, f.velocity_north,
              f.velocity_east, f.velocity_up, f.roll_deg, f.pitch_deg, f.azimuth_deg, f.status);
      return encode_pva(id, header, f);
    }
    case NovatelId::Inspvax: {
      PvaxFields f;
      in.into(f.status, f.position_type, f.latitude_deg, f.longitude_deg, f.height_m, f.undulation_m, f.velocity_north,
              f.velocity_east, f.velocity_up, f.roll_deg, f.pitch_deg, f.azimuth_deg);
      parse_sigma(in, f.sigma);
      return encode_pvax(header, f);
    }
    case NovatelId::Insstdev: {
      StdevFields f;
      parse_sigma(in, f);
      in.into(f.reserved1, f.reserved2, f.reserved3);
      return encode_stdev(id, header, f);
    }
    case NovatelId::Bestpos: {
      BestposFields f;
      in.into(f.solution_status, f.position_type, f.latitude_deg, f.longitude_deg, f.height_m, f.undulation_m, f.datum,
              f.sigma_latitude_m, f.sigma_longitude_m, f.sigma_height_m, f.station, f.differential_age_s,
              f.solution_age_s, f.tracked, f.used, f.used_l1, f.used_multi, f.reserved, f.extended_status,
              f.galileo_beidou_mask, f.gps_glonass_mask);
      return encode_bestpos(header, f);
    }
    case NovatelId::Time: {
      // The calendar is computed by the simulator; the figures of the receiver's clock are those of the message.
      TimeFields f = time_fields((header.week * 604'800'000LL + header.milliseconds) * 1'000'000LL);
      in.into(f.clock_status, f.offset_s, f.offset_sigma_s, f.utc_offset_s);
      return encode_time(header, f);
    }
    default:
      return {};
  }
}

TEST(NovatelEncode, RecordedLogsComeOutAgainBitByBit) {
  std::map<unsigned, int> compared;
  for (const char* file : {"ins1.gps", "ins2.gps", "bestpos.gps", "time.gps"}) {
    HUELINE_REQUIRE_DATA(std::filesystem::path("novatel") / file);
    for (const Message& message : test::novatel_messages(test::read_file(data_file))) {
      const Message again = encode_again(message);
      if (again.empty()) continue;
      const unsigned id = load<std::uint16_t>(message, 4);
      ASSERT_EQ(again, message) << "log " << id << " of " << file;
      ++compared[id];
    }
  }
  EXPECT_EQ(compared, (std::map<unsigned, int>{{42, 5}, {101, 6}, {508, 315}, {1465, 8}, {2051, 29}}));
}

TEST(NovatelEncode, CrcOfEveryRecordedMessage) {
  int checked = 0;
  for (const char* file : {"align.gps", "bestpos.gps", "ins1.gps", "ins2.gps", "rxstatus.gps", "time.gps"}) {
    HUELINE_REQUIRE_DATA(std::filesystem::path("novatel") / file);
    for (const Message& m : test::novatel_messages(test::read_file(data_file))) {
      ASSERT_EQ(novatel_crc32(std::span(m).first(m.size() - 4)), load<std::uint32_t>(m, m.size() - 4)) << file;
      ++checked;
    }
  }
  EXPECT_GT(checked, 1000);
}

TEST(NovatelEncode, Mark1TimeByHand) {
  // Week 2345 (0x0929), 1234.5 s (0x40934A0000000000).
  const GpsNs mark = 2345LL * 604'800'000'000'000LL + 1'234'500'000'000LL;
  const Message m = encode_mark1_time(novatel_header(mark), mark_time_fields(mark));
  ASSERT_EQ(m.size(), 28U + 40U + 4U);
  const std::uint8_t start[] = {0xAA, 0x44, 0x12, 28, 0x6A, 0x04, 0x00, 0x20, 40, 0};
  for (std::size_t i = 0; i < sizeof(start); ++i) EXPECT_EQ(std::to_integer<int>(m[i]), start[i]) << i;
  const std::uint8_t fields[] = {0x29, 0x09, 0, 0, 0, 0, 0, 0, 0, 0x4A, 0x93, 0x40};
  for (std::size_t i = 0; i < sizeof(fields); ++i) EXPECT_EQ(std::to_integer<int>(m[28 + i]), fields[i]) << i;
  EXPECT_EQ(load<double>(m, 56), -18.0);
  EXPECT_EQ(peek_novatel(m).id, 1130);
  EXPECT_EQ(peek_novatel(m).milliseconds, 1'234'500U);
}

TEST(NovatelEncode, SampleGoesIntoTheWiresUnitsAndOrder) {
  InsSample s;
  s.gps_ns = 2345LL * 604'800'000'000'000LL;
  s.latitude_rad = 0.8;
  s.longitude_rad = 0.1;
  s.ellipsoidal_height_m = 250;
  s.velocity_east = 1;
  s.velocity_north = 2;
  s.velocity_up = 3;
  s.roll_rad = 0.01;
  s.pitch_rad = -0.02;
  s.heading_rad = -0.5;
  s.sigma = {.1, .2, .3, .4, .5, .6, .007, .008, .009};
  const Message m = encode_pva(NovatelId::Inspvas, novatel_header(s.gps_ns), pva_fields(s));
  EXPECT_NEAR(load<double>(m, 24), 45.83662361, 1e-8);  // latitude
  EXPECT_NEAR(load<double>(m, 32), 5.729577951, 1e-9);  // longitude
  EXPECT_EQ(load<double>(m, 40), 250);                  // height above the ellipsoid
  EXPECT_EQ(load<double>(m, 48), 2);                    // north, east, up
  EXPECT_EQ(load<double>(m, 56), 1);
  EXPECT_EQ(load<double>(m, 64), 3);
  EXPECT_NEAR(load<double>(m, 72), 0.5729577951, 1e-9);  // roll, pitch, azimuth 0..360
  EXPECT_NEAR(load<double>(m, 80), -1.145915590, 1e-9);
  EXPECT_NEAR(load<double>(m, 88), 331.3521102, 1e-7);
  const Message sigma = encode_stdev(NovatelId::Insstdevs, novatel_header(s.gps_ns), stdev_fields(s));
  EXPECT_EQ(load<float>(sigma, 12), .2F);  // latitude = north
  EXPECT_EQ(load<float>(sigma, 16), .1F);
  EXPECT_EQ(load<float>(sigma, 24), .5F);
  EXPECT_EQ(load<float>(sigma, 28), .4F);
  EXPECT_NEAR(load<float>(sigma, 44), 0.5156620F, 1e-6F);
  const Message x = encode_pvax(novatel_header(s.gps_ns), pvax_fields(s, 47.25));
  EXPECT_EQ(load<double>(x, 28 + 24), 202.75);  // above the geoid
  EXPECT_EQ(load<float>(x, 28 + 32), 47.25F);
}

TEST(NovatelEncode, HeaderRoundsToTheNearestMillisecondAcrossTheWeek) {
  const GpsNs week = 604'800'000'000'000LL;
  EXPECT_EQ(novatel_header(10 * week - 400'000).week, 10);
  EXPECT_EQ(novatel_header(10 * week - 400'000).milliseconds, 0U);
  EXPECT_EQ(novatel_header(10 * week - 600'000).week, 9);
  EXPECT_EQ(novatel_header(10 * week - 600'000).milliseconds, 604'799'999U);
}

TEST(NovatelEncode, RawimusxIsAShortLogInTheWiresOrder) {
  RawImuFields f;
  f.week = 2345;
  f.z_accel = 1;
  f.minus_y_accel = -2;
  f.x_gyro = 6;
  const Message m = encode_rawimusx(novatel_header(0), f);
  ASSERT_EQ(m.size(), 12U + 40U + 4U);
  EXPECT_EQ(load<std::uint16_t>(m, 4), 1462);
  EXPECT_EQ(load<std::uint16_t>(m, 14), 2345);
  EXPECT_EQ(load<std::int32_t>(m, 28), 1);
  EXPECT_EQ(load<std::int32_t>(m, 32), -2);
  EXPECT_EQ(load<std::int32_t>(m, 48), 6);
}

}  // namespace
}  // namespace hueline::sim
