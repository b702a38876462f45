#include "drivers/velodyne/velodyne_decoder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/angle.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"

namespace hueline::drivers {
namespace {

using test::decode;
using test::Decoded;
using test::turning;
using test::velodyne_data;
using Blocks = test::VelodyneBlocksOfPacket;

VelodyneDecoder::Config hdl32e() {
  VelodyneDecoder::Config config;
  config.model = VelodyneModel::Hdl32e;
  return config;
}

TEST(VelodyneDecoder, Vlp16SingleTakesTimeAzimuthAndPlaceOfEachFiring) {
  VelodyneDecoder decoder({});
  const Decoded d = decode(decoder, velodyne_data(turning(9000, 40), 123'456'789, 0x37, 0x22));
  EXPECT_TRUE(d.faults.empty());
  ASSERT_EQ(d.batches.size(), 1u);
  EXPECT_EQ(d.batches[0].sensor, 5) << "the packet's";
  EXPECT_EQ(d.batches[0].time,
            LaserTime(LaserCounter{CounterOrigin::Utc, std::chrono::hours(1), nanoseconds(123'456'789'000)}));
  const auto& returns = d.batches[0].returns;
  ASSERT_EQ(returns.size(), 384u);
  // Manual 63-9243, table 9-1, typed again: elevation (degrees) and vertical offset (mm) of lasers 0 to 15.
  const double elevation[16] = {-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15};
  const double offset_mm[16] = {11.2, -0.7, 9.7, -2.2, 8.1, -3.7, 6.6, -5.1,
                                5.1,  -6.6, 3.7, -8.1, 2.2, -9.7, 0.7, -11.2};
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const std::size_t block = i / 32, sequence = i % 32 / 16, laser = i % 16;
    // Section 9.3.1: 55.296 us for a sequence, 2.304 us for a laser; two sequences in a block, while the azimuth goes
    // on.
    const double in_block_us = 55.296 * static_cast<double>(sequence) + 2.304 * static_cast<double>(laser);
    const double azimuth = (90 + 0.4 * (static_cast<double>(block) + in_block_us / 110.592)) * kRadPerDeg;
    const double el = elevation[laser] * kRadPerDeg;
    EXPECT_EQ(returns[i].time_offset_ns, std::lround(110592.0 * static_cast<double>(block) + 1000 * in_block_us));
    EXPECT_EQ(returns[i].channel, std::lround((elevation[laser] + 15) / 2));
    EXPECT_NEAR(returns[i].azimuth, azimuth, 1e-6);
    EXPECT_NEAR(returns[i].x, 10 * std::cos(el) * std::sin(azimuth), 5e-6);
    EXPECT_NEAR(returns[i].y, 10 * std::cos(el) * std::cos(azimuth), 5e-6);
    EXPECT_NEAR(returns[i].z, 10 * std::sin(el) + offset_mm[laser] * 1e-3, 5e-6);
    EXPECT_FLOAT_EQ(returns[i].range_m, 10);
    EXPECT_EQ(returns[i].reflectivity, 100);
    EXPECT_EQ(returns[i].return_count, 1);
  }
  EXPECT_EQ(decoder.counts().decoded_bytes, 1206u);
}

TEST(VelodyneDecoder, Hdl32eFiresAllLasersOnceABlock) {
  VelodyneDecoder decoder(hdl32e());
  const Decoded d = decode(decoder, velodyne_data(turning(0, 16), 1'000'000, 0x37, 0x21));
  ASSERT_EQ(d.batches.size(), 1u);
  const auto& returns = d.batches[0].returns;
  ASSERT_EQ(returns.size(), 384u);
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const double block = static_cast<double>(i / 32), laser = static_cast<double>(i % 32);
    EXPECT_EQ(returns[i].time_offset_ns, std::lround(46080 * block + 1152 * laser));
    EXPECT_NEAR(returns[i].azimuth, 0.16 * kRadPerDeg * (block + laser * 1.152 / 46.08), 1e-6);
    // The lasers of the lower bank fire at the even places, those of the upper bank at the odd ones: rings 0, 16, 1,
    // 17, ...
    EXPECT_EQ(returns[i].channel, i % 2 == 0 ? i % 32 / 2 : 16 + i % 32 / 2);
    const double elevation = std::asin(returns[i].z / 10) / kRadPerDeg;
    EXPECT_NEAR(elevation, -30.67 + returns[i].channel * 4.0 / 3, 0.011);
  }
}

TEST(VelodyneDecoder, AStampOfTheLastFiringIsTakenBackToTheFirst) {
  auto config = hdl32e();
  config.stamp = PacketStamp::LastFiring;
  VelodyneDecoder decoder(config);
  // HDL-32E manual, appendix E: the first firing is 542.592 us earlier. The hour turns.
  Decoded d = decode(decoder, velodyne_data(turning(0, 16), 1'000, 0x37, 0x21));
  EXPECT_EQ(test::counter(d.batches.at(0).time).count(), 1'000'000 - 542'592);
  decoder.reset();
  d = decode(decoder, velodyne_data(turning(0, 16), 100, 0x37, 0x21));
  EXPECT_EQ(test::counter(d.batches.at(0).time).count(), 3'600'000'000'000 + 100'000 - 542'592);
}

TEST(VelodyneDecoder, TheAzimuthIsInterpolatedThroughNorth) {
  VelodyneDecoder decoder({});
  const Decoded d = decode(decoder, velodyne_data(turning(35780, 40), 0, 0x37, 0x22));
  ASSERT_EQ(d.batches.at(0).returns.size(), 384u);
  double before = 357.7;
  for (const LaserReturn& r : d.batches[0].returns) {
    ASSERT_GE(r.azimuth, 0);
    ASSERT_LT(r.azimuth, 2 * M_PI);
    double azimuth = r.azimuth / kRadPerDeg;
    if (azimuth < 180) azimuth += 360;
    EXPECT_GT(azimuth, before);
    EXPECT_LT(azimuth, before + 0.2);
    before = azimuth;
  }
}

TEST(VelodyneDecoder, DualReturnsAreMergedOrCountedByRange) {
  Blocks blocks = turning(100, 40, true);
  const auto set = [&](std::size_t shot, test::VelodyneShot last, test::VelodyneShot strongest) {
    blocks[2].shots[shot] = last;
    blocks[3].shots[shot] = strongest;
  };
  set(0, {5000, 10}, {5000, 10});  // one echo
  set(1, {5000, 10}, {4000, 90});  // a nearer, stronger one
  set(2, {5000, 90}, {4000, 10});  // the last is the strongest: the odd block has the second strongest
  set(3, {0, 0}, {4000, 10});
  set(4, {5000, 10}, {0, 0});
  set(5, {0, 0}, {0, 0});
  set(6, {5000, 10}, {100, 90});  // 0.2 m: the housing
  const auto packet = velodyne_data(blocks, 0, 0x39, 0x22);
  const auto of_pair = [&](ReturnChoice choice) {
    VelodyneDecoder::Config config;
    config.returns = choice;
    VelodyneDecoder decoder(config);
    const Decoded decoded = decode(decoder, packet);
    std::vector<LaserReturn> found;
    for (const LaserReturn& r : decoded.batches.at(0).returns)
      if (r.time_offset_ns >= 110'592 && r.time_offset_ns < 110'592 + 7 * 2'304) found.push_back(r);
    return found;
  };
  const auto expect = [](const LaserReturn& r, int shot, float range, int reflectivity, int number, int count) {
    EXPECT_EQ(r.time_offset_ns, 110'592 + 2'304 * shot);
    EXPECT_FLOAT_EQ(r.range_m, range);
    EXPECT_EQ(r.reflectivity, reflectivity);
    EXPECT_EQ(r.return_number, number);
    EXPECT_EQ(r.return_count, count);
  };
  auto r = of_pair(ReturnChoice::All);
  ASSERT_EQ(r.size(), 8u);
  expect(r[0], 0, 10, 10, 1, 1);
  expect(r[1], 1, 8, 90, 1, 2);
  expect(r[2], 1, 10, 10, 2, 2);
  expect(r[3], 2, 8, 10, 1, 2);
  expect(r[4], 2, 10, 90, 2, 2);
  expect(r[5], 3, 8, 10, 1, 1);
  expect(r[6], 4, 10, 10, 1, 1);
  expect(r[7], 6, 10, 10, 2, 2);
  r = of_pair(ReturnChoice::Strongest);
  ASSERT_EQ(r.size(), 5u);
  expect(r[1], 1, 8, 90, 1, 2);
  expect(r[2], 2, 10, 90, 2, 2);
  r = of_pair(ReturnChoice::Last);
  ASSERT_EQ(r.size(), 6u);
  expect(r[1], 1, 10, 10, 2, 2);
  expect(r[2], 2, 10, 90, 2, 2);
}

TEST(VelodyneDecoder, RangeAndAzimuthWindowsAreClosedIntervals) {
  Blocks blocks = turning(35900, 20);
  for (auto& block : blocks)
    for (std::size_t i = 0; i < 32; ++i) block.shots[i].distance = i % 2 ? 500 : 499;
  VelodyneDecoder::Config config;
  config.min_range_m = 1.0;
  config.azimuth_begin = 359.5 * kRadPerDeg;
  config.azimuth_end = 0.5 * kRadPerDeg;
  ASSERT_EQ(config.validate(), "");
  VelodyneDecoder decoder(config);
  const Decoded d = decode(decoder, velodyne_data(blocks, 0, 0x37, 0x22));
  std::size_t expected = 0;
  for (int b = 0; b < 12; ++b)
    for (int f = 1; f < 32; f += 2) {
      const double azimuth = 359 + 0.2 * (b + (55.296 * (f / 16) + 2.304 * (f % 16)) / 110.592);
      expected += azimuth >= 359.5 && azimuth <= 360.5 ? 1 : 0;
    }
  EXPECT_EQ(d.batches.at(0).returns.size(), expected);
  for (const LaserReturn& r : d.batches[0].returns) EXPECT_FLOAT_EQ(r.range_m, 1.0f);
}

TEST(VelodyneDecoder, ConfigNamesTheWrongKey) {
  VelodyneDecoder::Config config;
  EXPECT_EQ(config.validate(), "");
  config.max_range_m = 0.1;
  EXPECT_THAT(config.validate(), testing::HasSubstr("max_range_m"));
  config = {};
  config.azimuth_end = 7;
  EXPECT_THAT(config.validate(), testing::HasSubstr("azimuth_end"));
  config = {};
  config.min_range_m = std::nan("");
  EXPECT_THAT(config.validate(), testing::HasSubstr("min_range_m"));
}

}  // namespace
}  // namespace hueline::drivers
