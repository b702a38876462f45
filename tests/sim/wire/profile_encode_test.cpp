// Compares the encoder with bytes that were written by hand from docs/formats.md.
#include "sim/wire/profile_encode.hpp"

#include <gtest/gtest.h>

#include <initializer_list>

namespace hueline::sim {
namespace {

Bytes hex(std::initializer_list<int> values) {
  Bytes out;
  for (const int v : values) out.push_back(static_cast<std::byte>(v));
  return out;
}

/// 2026-01-01T00:00:00.000000005 UTC: GPS second 1451260818, Unix second 1767225600 = 0x6955B900.
constexpr GpsNs kNewYear = 1'451'260'818LL * 1'000'000'000 + 5;

TEST(ProfileEncode, DataAreTheDocumentsBytes) {
  ProfilePacket p;
  p.first_pulse_gps_ns = kNewYear;
  p.line = 2;
  p.angle = 0x80000001;
  p.angle_step = -2;
  p.period_ps = 833'333;
  p.counts = {1, 0, 2};
  p.range_100um = {10'000, 20'000, 0x01020304};
  p.reflectance_1e4 = {5'000, 1, 65'535};
  const auto bytes = encode_profile_data(p, 7);
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(*bytes, hex({'P',  'R',  'F',  '1',  1,    1,    1,    0,    7,    0,    0,    0,
                         65,   0,    1,    0,    0x00, 0xB9, 0x55, 0x69, 5,    0,    0,    0,  //
                         2,    0,    0,    0,    0x01, 0,    0,    0x80, 0xFE, 0xFF, 0xFF, 0xFF,
                         0x35, 0xB7, 0x0C, 0,    3,    0,    3,    0,  //
                         1,    0,    2,    0x10, 0x27, 0,    0,    0x88, 0x13, 0x20, 0x4E, 0,
                         0,    1,    0,    4,    3,    2,    1,    0xFF, 0xFF}));
  p.counts[0] = 2;
  EXPECT_EQ(encode_profile_data(p, 7).error().code, ErrorCode::Invalid);
}

TEST(ProfileEncode, StatusIsTheDocumentsBytes) {
  ProfileStatusReport report;
  report.sent_gps_ns = kNewYear + 300'000'000;
  report.counter = 0x01000000;
  report.pps_status = 1;
  report.is_label_valid = false;
  EXPECT_EQ(encode_profile_status(report),
            hex({'P',  'R',  'F',  '1',  1,    2,    1,    0,    0, 0, 0, 1, 32,   0,    1,    0,
                 0x00, 0xB9, 0x55, 0x69, 0x05, 0xA3, 0xE1, 0x11, 1, 1, 0, 0, 0x00, 0xB9, 0x55, 0x69}));
}

}  // namespace
}  // namespace hueline::sim
