#include "drivers/novatel/imu.hpp"

#include <gtest/gtest.h>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/novatel/decoder.hpp"
#include "tests/drivers/novatel/novatel_encoder.hpp"

namespace hueline::drivers {
namespace {

using test::all_of;
using test::Put;
constexpr double kPi = 3.14159265358979323846;

std::vector<Measurement> decoded(const test::Bytes& bytes, const NovatelDecoder::Config& config = {}) {
  NovatelDecoder decoder(config);
  std::vector<Measurement> out;
  decoder.decode(test::packet_of(bytes), out);
  return out;
}

/// In the order of the message: z, -y, x of the velocity increments, then of the angles.
test::Bytes rawimusx(unsigned type, double seconds, const std::array<std::int32_t, 6>& counts, unsigned info = 4) {
  Put p;
  p.u8(info).u8(type).u16(2209).f64(seconds).u32(0xea59fe00u);
  for (const std::int32_t count : counts) p.i32(count);
  return test::short_message(1462, 2209, test::milliseconds_of(seconds), p.bytes);
}

TEST(NovatelImu, ManualsRawimusxExample) {
  // %RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,196192,417138,-1000837: an
  // Epson G320 at rest. Computed by hand: 0.2 mg / 65536 / 125 a count, times 125 a second: 329308016 * 0.2 / 65536 *
  // 9.80665e-3 = 9.855 m/s^2 upwards.
  const auto samples =
      all_of<ImuSample>(decoded(rawimusx(41, 491674.013699, {329308016, -2706935, 4508389, 196192, 417138, -1000837})));
  ASSERT_EQ(samples.size(), 1u);
  const ImuSample& s = samples[0];
  EXPECT_EQ(s.time, from_gps_week(2209, std::chrono::microseconds(491674013699)));
  EXPECT_NEAR(s.specific_force_body.x(), 0.13492490537, 1e-9);
  EXPECT_NEAR(s.specific_force_body.y(), 0.08101185338, 1e-9);  // the wire has -y
  EXPECT_NEAR(s.specific_force_body.z(), 9.85537248262, 1e-9);
  EXPECT_NEAR(s.angular_rate_body.x() / kRadPerDeg, -0.12217248535, 1e-9);
  EXPECT_NEAR(s.angular_rate_body.y() / kRadPerDeg, -0.05092016601, 1e-9);
  EXPECT_NEAR(s.angular_rate_body.z() / kRadPerDeg, 0.02394921875, 1e-9);
}

TEST(NovatelImu, UnitsOfEachKindOfImu) {
  // One count, as in the manual's table.
  const double foot = 0.3048, arcsec = kPi / 180 / 3600;
  EXPECT_DOUBLE_EQ(imu_scale(8)->rad_per_count, 1.0 / 524288);
  EXPECT_DOUBLE_EQ(imu_scale(8)->mps_per_count, 1.0 / 16384);
  EXPECT_DOUBLE_EQ(imu_scale(11)->mps_per_count, foot / 134217728);
  EXPECT_DOUBLE_EQ(imu_scale(12)->mps_per_count, foot / 67108864);
  EXPECT_DOUBLE_EQ(imu_scale(13)->rad_per_count, 0.1 * arcsec / 256);
  EXPECT_DOUBLE_EQ(imu_scale(33)->rad_per_count, 0.1 * arcsec / 256);
  EXPECT_DOUBLE_EQ(imu_scale(33)->mps_per_count, 0.05 / 32768);
  EXPECT_DOUBLE_EQ(imu_scale(32)->rad_per_count, kRadPerDeg / 2097152);
  EXPECT_DOUBLE_EQ(imu_scale(58)->mps_per_count, 1.0 / 536870912);
  EXPECT_EQ(imu_scale(69)->rate_hz, 400);
  EXPECT_FALSE(imu_scale(0));
  EXPECT_FALSE(imu_scale(250));
}

TEST(NovatelImu, ImuErrorsAndUnknownTypesGiveNoSample) {
  EXPECT_TRUE(all_of<ImuSample>(decoded(rawimusx(41, 1, {1, 1, 1, 1, 1, 1}, 5))).empty());
  EXPECT_TRUE(all_of<ImuSample>(decoded(rawimusx(250, 1, {1, 1, 1, 1, 1, 1}))).empty());
  NovatelDecoder::Config config;
  config.imu = {.rate_hz = 100, .rad_per_count = 1e-6, .mps_per_count = 1e-5};
  const auto samples = all_of<ImuSample>(decoded(rawimusx(250, 1, {3, -2, 1, 6, -5, 4}), config));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_NEAR((samples[0].specific_force_body - Eigen::Vector3d(1e-3, 2e-3, 3e-3)).norm(), 0, 1e-15);
  EXPECT_NEAR((samples[0].angular_rate_body - Eigen::Vector3d(4e-4, 5e-4, 6e-4)).norm(), 0, 1e-15);
}

TEST(NovatelImu, RotationOfTheMounting) {
  // RBV of 90 degrees about z: the vehicle's axes are the IMU's, turned by +90 degrees about z. So vehicle x = IMU y,
  // and vehicle y = minus IMU x.
  NovatelDecoder::Config config;
  config.imu = {.rate_hz = 1, .rad_per_count = 1, .mps_per_count = 1, .rotation_rbv_deg = {0, 0, 90}};
  const auto samples = all_of<ImuSample>(decoded(rawimusx(250, 1, {0, 0, 1, 0, -1, 0}), config));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_NEAR((samples[0].specific_force_body - Eigen::Vector3d(0, -1, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((samples[0].angular_rate_body - Eigen::Vector3d(1, 0, 0)).norm(), 0, 1e-12);
}

test::Bytes corrimus(unsigned week, double seconds, std::uint32_t samples, const std::array<double, 6>& increments) {
  Put p;
  p.u32(samples);
  for (const double v : increments) p.f64(v);
  p.u32(0).u32(0);
  return test::short_message(2264, week, test::milliseconds_of(seconds), p.bytes);
}

TEST(NovatelImu, CorrectedIncrementsGetGravityAndEarthRotationBack) {
  NovatelDecoder::Config config;
  config.imu.imu_type = 41;  // 125 Hz
  // On the equator at height 0, with the nose to the east, rolled 30 degrees to the right, accelerating forward with 2
  // m/s^2 and turning with 0.1 rad/s.
  const auto pose = test::inspvas({.week = 2300, .seconds = 99.95, .roll_deg = 30, .azimuth_deg = 90});
  const auto out =
      decoded(test::joined({pose, corrimus(2300, 100, 25, {0, 0, 0.02, 0, 0.4, 0})}), config);  // 25 samples: 0.2 s
  const auto samples = all_of<ImuSample>(out);
  ASSERT_EQ(samples.size(), 1u);
  const double g = 9.7803253359;  // WGS84, equator
  EXPECT_NEAR((samples[0].specific_force_body - Eigen::Vector3d(-g * 0.5, 2, g * std::sqrt(0.75))).norm(), 0, 1e-9);
  // The nose points east, so north is to the left and, after the roll, 30 degrees below the direction of the left side.
  const double w = 7.292115e-5;
  EXPECT_NEAR((samples[0].angular_rate_body - Eigen::Vector3d(-w * std::sqrt(0.75), 0, 0.1 - w * 0.5)).norm(), 0,
              1e-12);

  // Without an attitude, or with one that is too old, the direction of gravity is not known.
  EXPECT_TRUE(all_of<ImuSample>(decoded(corrimus(2300, 100, 25, {0, 0, 0, 0, 0, 0}), config)).empty());
  EXPECT_TRUE(
      all_of<ImuSample>(decoded(test::joined({pose, corrimus(2300, 100.5, 25, {0, 0, 0, 0, 0, 0})}), config)).empty());
}

TEST(NovatelImu, CorrimudataNeedsItsLoggingRate) {
  Put p;
  p.u32(2300).f64(100.0);
  for (int i = 0; i < 6; ++i) p.f64(0.001);
  const auto bytes =
      test::joined({test::inspvas({.week = 2300, .seconds = 100.0}), test::short_message(813, 2300, 100000, p.bytes)});
  EXPECT_TRUE(all_of<ImuSample>(decoded(bytes)).empty());
  NovatelDecoder::Config config;
  config.imu.corrimudata_rate_hz = 100;
  const auto samples = all_of<ImuSample>(decoded(bytes, config));
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_NEAR(samples[0].specific_force_body.x(), 0.1, 1e-12);
  EXPECT_NEAR(samples[0].angular_rate_body.x(), 0.1, 1e-3);
}

TEST(NovatelImu, ConfigNamesTheWrongKey) {
  NovatelImu::Config config;
  EXPECT_EQ(config.validate(), "");
  config.rate_hz = -1;
  EXPECT_NE(config.validate().find("rate_hz"), std::string::npos);
}

}  // namespace
}  // namespace hueline::drivers
