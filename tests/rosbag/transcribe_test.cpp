// Poses of messages of ROS, read back by the decoder of the receiver whose logs they become.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <variant>

#include "core/calendar.hpp"
#include "drivers/device.hpp"
#include "drivers/ros/ros_pose.hpp"
#include "tests/rosbag/sample_bag.hpp"

namespace hueline {
namespace {

using drivers::RosEncoding;
using drivers::RosPose;
using drivers::RosPoseRank;
using drivers::RosReader;

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::int64_t kBegin_ns = 1'700'000'000'000'000'000;

std::vector<Measurement> decoded(const std::vector<RosPose::Logs>& logs) {
  std::unique_ptr<Decoder> decoder;
  for (const auto* type : drivers::device_types())
    if (std::string_view(type->word) == "novatel") decoder = type->make()->make_decoder();
  std::vector<Measurement> out;
  for (const auto& one : logs)
    decoder->decode({1, PacketKind::Wire, false, 0, host_time_ns(count_ns(one.received)), one.bytes}, out);
  decoder->flush(out);
  return out;
}
template <class T>
std::vector<T> all_of(const std::vector<Measurement>& measurements) {
  std::vector<T> out;
  for (const Measurement& one : measurements)
    if (const auto* found = std::get_if<T>(&one)) out.push_back(*found);
  return out;
}
RosReader reader(const test::RosWriter& message) {
  return {std::as_bytes(std::span(message.bytes())), RosEncoding::Cdr};
}

test::RosWriter fix(std::int64_t ns, double latitude, double longitude, double height) {
  test::RosWriter out(RosEncoding::Cdr);
  out.header(ns, "gps").put(std::int8_t{0}).put(std::uint16_t{1}).put(latitude).put(longitude).put(height);
  for (const double variance : {4.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 16.0}) out.put(variance);
  return out.put(std::uint8_t{2});
}
test::RosWriter imu(std::int64_t ns, const std::array<double, 4>& xyzw, double covariance = 0) {
  test::RosWriter out(RosEncoding::Cdr);
  out.header(ns, "imu");
  for (const double value : xyzw) out.put(value);
  return out.put(covariance);
}

TEST(RosPose, KeepsTheValuesOfAReceiver) {
  test::RosWriter message(RosEncoding::Cdr);
  message.header(kBegin_ns, "ins").text("INSPVAX").put(std::uint16_t{1465}).put(std::uint8_t{0});
  message.put(std::uint32_t{0}).put(std::uint8_t{180}).put(std::uint16_t{2300}).put(std::uint32_t{123'456'005});
  message.put(std::uint32_t{3}).put(std::uint32_t{56}).put(48.1).put(-11.5).put(500.0).put(47.5f);
  message.put(1.0).put(2.0).put(-3.0).put(4.0).put(-5.0).put(300.0);
  for (int i = 1; i <= 9; ++i) message.put(static_cast<float>(i));
  std::vector<RosPose::Logs> logs;
  RosPose pose(RosPoseRank::Solution, {});
  ASSERT_TRUE(pose.take("novatel_oem7_msgs/INSPVAX", reader(message), UnixTime{}, logs));
  const auto measurements = decoded(logs);
  const auto solutions = all_of<InsSolution>(measurements);
  ASSERT_EQ(solutions.size(), 1u);
  const InsSolution& one = solutions[0];
  EXPECT_EQ(one.time, from_gps_week(2300, std::chrono::milliseconds(123'456'005)));
  EXPECT_EQ(count_ns(one.received), kBegin_ns);
  EXPECT_TRUE(one.is_good);
  EXPECT_NEAR(one.position.latitude, 48.1 * kDegree, 1e-12);
  EXPECT_NEAR(one.position.longitude, -11.5 * kDegree, 1e-12);
  EXPECT_NEAR(one.position.ellipsoidal_height, 547.5, 1e-9);
  EXPECT_TRUE(one.velocity_enu.isApprox(Eigen::Vector3d(2, 1, -3), 1e-12));
  EXPECT_NEAR(one.attitude.roll, 4 * kDegree, 1e-12);
  EXPECT_NEAR(one.attitude.pitch, -5 * kDegree, 1e-12);
  EXPECT_NEAR(one.attitude.heading, 300 * kDegree, 1e-12);
  const auto sigmas = all_of<InsUncertainty>(measurements);
  ASSERT_EQ(sigmas.size(), 1u);
  const std::array<double, 9> expected{2, 1, 3, 5, 4, 6, 7 * kDegree, 8 * kDegree, 9 * kDegree};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(sigmas[0].sigma[i], expected[i], 1e-9) << i;
}

/// The head of a message of novatel_oem7_msgs: header and nov_header.
test::RosWriter of_receiver(const std::string& log, std::uint32_t ms) {
  test::RosWriter out(RosEncoding::Cdr);
  out.header(kBegin_ns, "ins").text(log).put(std::uint16_t{1}).put(std::uint8_t{0}).put(std::uint32_t{0});
  return out.put(std::uint8_t{180}).put(std::uint16_t{2300}).put(ms);
}

TEST(RosPose, GivesSolutionsTheSigmasOfMessagesOfTheirOwn) {
  test::RosWriter stdev = of_receiver("INSSTDEV", 123'456'000);
  for (int i = 1; i <= 9; ++i) stdev.put(static_cast<float>(i));
  stdev.put(std::uint32_t{0}).put(std::uint16_t{0}).put(std::uint16_t{0}).put(std::uint32_t{0}).put(std::uint32_t{0});
  test::RosWriter pva = of_receiver("INSPVA", 123'456'100);
  for (const double value : {48.1, -11.5, 547.5, 1., 2., -3., 4., -5., 300.}) pva.put(value);
  pva.put(std::uint32_t{3});
  std::vector<RosPose::Logs> logs;
  RosPose pose(RosPoseRank::Solution, {});
  ASSERT_TRUE(pose.take("novatel_oem7_msgs/INSSTDEV", reader(stdev), UnixTime{}, logs));
  ASSERT_TRUE(pose.take("novatel_oem7_msgs/INSPVA", reader(pva), UnixTime{}, logs));
  const auto measurements = decoded(logs);
  const auto sigmas = all_of<InsUncertainty>(measurements);
  ASSERT_EQ(sigmas.size(), 1u);
  EXPECT_EQ(sigmas[0].time, from_gps_week(2300, std::chrono::milliseconds(123'456'000)));
  EXPECT_NEAR(sigmas[0].sigma[0], 2, 1e-9) << "of the longitude, to the east";
  EXPECT_NEAR(sigmas[0].sigma[8], 9 * kDegree, 1e-9);
  const auto solutions = all_of<InsSolution>(measurements);
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_EQ(solutions[0].time, from_gps_week(2300, std::chrono::milliseconds(123'456'100)));
  EXPECT_NEAR(solutions[0].position.ellipsoidal_height, 547.5, 1e-9);
}

/// novatel_gps_driver writes words where the receiver has numbers.
TEST(RosPose, ReadsSolutionsOfTheOtherDriverForNovatel) {
  const auto head = [](RosEncoding encoding, const std::string& log) {
    test::RosWriter out(encoding);
    out.header(kBegin_ns, "ins").text(log).text("COM1").put(std::uint32_t{0}).put(1.5f).text("FINESTEERING");
    out.put(std::uint32_t{2300}).put(123'456.5).put(std::uint32_t{0});
    out.raw(std::string(23, '\0'));
    return out.put(std::uint32_t{7});
  };
  for (const RosEncoding encoding : {RosEncoding::Ros1, RosEncoding::Cdr})
    for (const char* status : {"INS_SOLUTION_GOOD", "INS_ALIGNING"}) {
      test::RosWriter pvax = head(encoding, "INSPVAX");
      pvax.text(status).text("INS_RTKFIXED").put(48.1).put(-11.5).put(500.0).put(47.5f);
      for (const double value : {1., 2., -3., 4., -5., 300.}) pvax.put(value);
      for (int i = 1; i <= 9; ++i) pvax.put(static_cast<float>(i));
      test::RosWriter pva = head(encoding, "INSPVA");
      pva.put(std::uint32_t{2300}).put(123'456.75);
      for (const double value : {48.1, -11.5, 547.5, 1., 2., -3., 4., -5., 300.}) pva.put(value);
      pva.text(status);
      test::RosWriter stdev = head(encoding, "INSSTDEV");
      for (int i = 1; i <= 9; ++i) stdev.put(static_cast<float>(i));
      const auto in = [&](const test::RosWriter& message) {
        return RosReader(std::as_bytes(std::span(message.bytes())), encoding);
      };
      std::vector<RosPose::Logs> logs;
      RosPose pose(RosPoseRank::Solution, {});
      ASSERT_TRUE(pose.take("novatel_gps_msgs/Inspvax", in(pvax), UnixTime{}, logs));
      ASSERT_TRUE(pose.take("novatel_gps_msgs/Inspva", in(pva), UnixTime{}, logs));
      ASSERT_TRUE(pose.take("novatel_gps_msgs/Insstdev", in(stdev), UnixTime{}, logs));
      const auto measurements = decoded(logs);
      const auto solutions = all_of<InsSolution>(measurements);
      ASSERT_EQ(solutions.size(), 2u);
      EXPECT_EQ(all_of<InsUncertainty>(measurements).size(), 2u);
      const GpsTime week = from_gps_week(2300, nanoseconds(0));
      EXPECT_EQ(solutions[0].time - week, std::chrono::milliseconds(123'456'500));
      EXPECT_EQ(solutions[1].time - week, std::chrono::milliseconds(123'456'750)) << "the log's own, not the header's";
      for (const InsSolution& one : solutions) {
        EXPECT_EQ(one.is_good, std::string_view(status) == "INS_SOLUTION_GOOD");
        EXPECT_NEAR(one.position.ellipsoidal_height, 547.5, 1e-9);
        EXPECT_NEAR(one.attitude.heading, 300 * kDegree, 1e-12);
      }
      const std::string whole = pvax.bytes();
      for (std::size_t size = 0; size < whole.size(); ++size) {
        const std::string cut = whole.substr(0, size);
        EXPECT_FALSE(pose.take("novatel_gps_msgs/Inspvax", {std::as_bytes(std::span(cut)), encoding}, {}, logs));
      }
    }
}

TEST(RosPose, TakesTheOrientationOfAnOdometryBesidePositions) {
  RosPose pose(RosPoseRank::Part, {});
  std::vector<RosPose::Logs> logs;
  test::RosWriter odometry(RosEncoding::Cdr);
  odometry.header(kBegin_ns + 500'000'000, "odom").text("base_link").put(5e6).put(-3.0).put(0.0);
  const double c = std::cos(std::numbers::pi / 4);
  odometry.put(0.0).put(0.0).put(c).put(c);  // to the north
  ASSERT_TRUE(pose.take("sensor_msgs/NavSatFix", reader(fix(kBegin_ns, 10, 20, 100)), UnixTime{}, logs));
  ASSERT_TRUE(pose.take("nav_msgs/Odometry", reader(odometry), UnixTime{}, logs));
  ASSERT_TRUE(
      pose.take("sensor_msgs/NavSatFix", reader(fix(kBegin_ns + 1'000'000'000, 10, 20, 104)), UnixTime{}, logs));
  pose.finish(logs);
  const auto solutions = all_of<InsSolution>(decoded(logs));
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_NEAR(solutions[0].position.ellipsoidal_height, 102, 1e-6) << "the place is that of the fixes";
  EXPECT_NEAR(solutions[0].position.latitude, 10 * kDegree, 1e-9);
  EXPECT_NEAR(std::remainder(solutions[0].attitude.heading, 2 * std::numbers::pi), 0, 1e-9);
}

TEST(RosPose, JoinsPositionsWithOrientations) {
  RosPose pose(RosPoseRank::Part, {});
  std::vector<RosPose::Logs> logs;
  const double c = std::cos(std::numbers::pi / 4);
  // Forward is east; then a quarter turn to the left, north; then nose 30 deg up towards the east.
  const double up = std::sin(-15 * kDegree), along = std::cos(15 * kDegree);
  ASSERT_TRUE(pose.take("sensor_msgs/NavSatFix", reader(fix(kBegin_ns, 10, 20, 100)), UnixTime{}, logs));
  ASSERT_TRUE(pose.take("sensor_msgs/Imu", reader(imu(kBegin_ns + 250'000'000, {0, 0, 0, 1})), UnixTime{}, logs));
  ASSERT_TRUE(pose.take("sensor_msgs/Imu", reader(imu(kBegin_ns + 500'000'000, {0, 0, c, c})), UnixTime{}, logs));
  ASSERT_TRUE(
      pose.take("sensor_msgs/Imu", reader(imu(kBegin_ns + 1'000'000'000, {0, up, 0, along})), UnixTime{}, logs));
  EXPECT_FALSE(pose.take("sensor_msgs/Imu", reader(imu(kBegin_ns + 1, {0, 0, 0, 1}, -1)), UnixTime{}, logs))
      << "a sensor that says that it has no orientation";
  ASSERT_TRUE(
      pose.take("sensor_msgs/NavSatFix", reader(fix(kBegin_ns + 1'000'000'000, 10, 20, 104)), UnixTime{}, logs));
  pose.finish(logs);
  const auto solutions = all_of<InsSolution>(decoded(logs));
  ASSERT_EQ(solutions.size(), 3u);
  EXPECT_EQ(solutions[0].time, from_unix(UnixTime(nanoseconds(kBegin_ns + 250'000'000))));
  EXPECT_NEAR(solutions[0].position.ellipsoidal_height, 101, 1e-6);
  EXPECT_NEAR(solutions[1].position.ellipsoidal_height, 102, 1e-6);
  EXPECT_NEAR(solutions[0].velocity_enu.z(), 4, 1e-6);
  EXPECT_NEAR(solutions[0].attitude.heading, 90 * kDegree, 1e-9);
  EXPECT_NEAR(std::remainder(solutions[1].attitude.heading, 2 * std::numbers::pi), 0, 1e-9);
  EXPECT_NEAR(solutions[2].attitude.pitch, 30 * kDegree, 1e-9);
  EXPECT_NEAR(solutions[2].attitude.heading, 90 * kDegree, 1e-9);
}

TEST(RosPose, PlacesLocalMetresAtTheirOrigin) {
  const Geodetic origin{10 * kDegree, 20 * kDegree, 100};
  // Vicon and ROVIO give the vehicle's place as a TransformStamped, which begins as Odometry does.
  for (const char* type : {"nav_msgs/Odometry", "geometry_msgs/TransformStamped"}) {
    RosPose pose(RosPoseRank::Local, drivers::world_about(origin));
    std::vector<RosPose::Logs> logs;
    for (int i = 0; i < 2; ++i) {
      test::RosWriter message(RosEncoding::Cdr);
      message.header(kBegin_ns + i * 100'000'000, "odom").text("base_link").put(0.0).put(0.0).put(5.0 + i);
      message.put(0.0).put(0.0).put(0.0).put(1.0);
      ASSERT_TRUE(pose.take(type, reader(message), UnixTime{}, logs));
    }
    const auto solutions = all_of<InsSolution>(decoded(logs));
    ASSERT_EQ(solutions.size(), 2u) << "the first waits for the velocity";
    EXPECT_NEAR(solutions[0].position.ellipsoidal_height, 105, 1e-6);
    EXPECT_NEAR(solutions[1].position.ellipsoidal_height, 106, 1e-6);
    EXPECT_NEAR(solutions[1].position.latitude, origin.latitude, 1e-12);
    for (const InsSolution& one : solutions) EXPECT_NEAR(one.velocity_enu.z(), 10, 1e-6);
  }
}

test::RosWriter pose_message(std::int64_t ns, const std::array<double, 3>& place, const std::array<double, 4>& xyzw) {
  test::RosWriter out(RosEncoding::Cdr);
  out.header(ns, "map");
  for (const double value : place) out.put(value);
  for (const double value : xyzw) out.put(value);
  return out;
}

TEST(RosPose, TurnsOrientationsToTheLevelOfTheirPlace) {
  const Geodetic origin{50 * kDegree, 10 * kDegree, 100};
  const auto T_ecef_origin = ecef_from_enu(origin);
  RosPose pose(RosPoseRank::Local, drivers::world_about(origin));
  std::vector<RosPose::Logs> logs;
  for (int i = 0; i < 2; ++i) {
    // The vehicle stands level and looks to the east, as both are at its own place.
    const Geodetic place{50 * kDegree, (10.1 + 1e-6 * i) * kDegree, 100};
    const auto T_ecef_place = ecef_from_enu(place);
    const Eigen::Vector3d enu = T_ecef_origin.rotation.conjugate() * (to_ecef(place).xyz - to_ecef(origin).xyz);
    const Eigen::Quaterniond q = T_ecef_origin.rotation.conjugate() * T_ecef_place.rotation;
    const auto message =
        pose_message(kBegin_ns + i * 100'000'000, {enu.x(), enu.y(), enu.z()}, {q.x(), q.y(), q.z(), q.w()});
    ASSERT_TRUE(pose.take("geometry_msgs/PoseStamped", reader(message), UnixTime{}, logs));
  }
  const auto solutions = all_of<InsSolution>(decoded(logs));
  ASSERT_EQ(solutions.size(), 2u);
  for (const InsSolution& one : solutions) {
    EXPECT_NEAR(one.attitude.heading, 90 * kDegree, 1e-9) << "the meridians are 0.077 deg from parallel";
    EXPECT_NEAR(one.attitude.roll, 0, 1e-9);
    EXPECT_NEAR(one.attitude.pitch, 0, 1e-9);
  }
}

TEST(RosPose, ReadsStampedPosesWithTheirCovariances) {
  const Geodetic origin{10 * kDegree, 20 * kDegree, 100};
  const double c = std::cos(std::numbers::pi / 4);
  RosPose pose(RosPoseRank::Local, drivers::world_about(origin));
  std::vector<RosPose::Logs> logs;
  for (int i = 0; i < 2; ++i) {
    // Forward is north: what turns about east is the pitch, about north the roll.
    auto message = pose_message(kBegin_ns + i * 100'000'000, {0, 0.5 * i, 7}, {0, 0, c, c});
    const std::array<double, 6> sigma{0.1, 0.2, 0.3, 1 * kDegree, 2 * kDegree, 3 * kDegree};
    for (std::size_t row = 0; row < 6; ++row)
      for (std::size_t column = 0; column < 6; ++column) message.put(row == column ? sigma[row] * sigma[row] : 0.0);
    ASSERT_TRUE(pose.take("geometry_msgs/PoseWithCovarianceStamped", reader(message), UnixTime{}, logs));
  }
  const auto measurements = decoded(logs);
  const auto solutions = all_of<InsSolution>(measurements);
  ASSERT_EQ(solutions.size(), 2u);
  EXPECT_EQ(solutions[1].time, from_unix(UnixTime(nanoseconds(kBegin_ns + 100'000'000))));
  EXPECT_NEAR(solutions[1].position.ellipsoidal_height, 107, 1e-6);
  EXPECT_NEAR(solutions[1].velocity_enu.y(), 5, 1e-6);
  EXPECT_NEAR(std::remainder(solutions[1].attitude.heading, 2 * std::numbers::pi), 0, 1e-9);
  const auto sigmas = all_of<InsUncertainty>(measurements);
  ASSERT_EQ(sigmas.size(), 2u);
  const std::array<double, 9> expected{0.1, 0.2, 0.3, 0.1, 0.1, 0.1, 2 * kDegree, 1 * kDegree, 3 * kDegree};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(sigmas[0].sigma[i], expected[i], 1e-7) << i;

  RosPose plain(RosPoseRank::Local, drivers::world_about(origin));
  logs.clear();
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(plain.take("geometry_msgs/PoseStamped",
                           reader(pose_message(kBegin_ns + i * 100'000'000, {3, 4, 5}, {0, 0, 0, 1})), UnixTime{},
                           logs));
  EXPECT_NEAR(all_of<InsSolution>(decoded(logs)).at(1).position.ellipsoidal_height, 105, 1e-5);
  EXPECT_TRUE(all_of<InsUncertainty>(decoded(logs)).empty());
  EXPECT_FALSE(plain.take("geometry_msgs/PoseStamped", reader(pose_message(kBegin_ns, {0, 0, 0}, {0, 0, 0, 0})),
                          UnixTime{}, logs));
}

TEST(RosPose, FollowsTheTransformsFromTheBodyToTheWorld) {
  const double c = std::cos(std::numbers::pi / 4);
  drivers::RosTransformPath path{
      {{"base_link", "odom", {}}, {"odom", "map", {}}, {"map", "world", Eigen::Isometry3d::Identity()}}};
  path.steps[2].fixed->translation().z() = 20;
  RosPose pose(RosPoseRank::Local, drivers::world_about({10 * kDegree, 20 * kDegree, 100}), nanoseconds(0), path);
  std::vector<RosPose::Logs> logs;
  const auto take = [&](const std::string& parent, const std::string& child, std::int64_t ms, double x, double z,
                        double turn) {
    test::RosWriter out(RosEncoding::Cdr);
    // Another frame moves, too.
    out.put(std::uint32_t{2}).header(kBegin_ns + ms * 1'000'000, "base_link").text("wheel");
    for (const double value : {0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0}) out.put(value);
    out.header(kBegin_ns + ms * 1'000'000, parent).text("/" + child);
    for (const double value : {x, 0.0, z, 0.0, 0.0, turn, turn == 0 ? 1.0 : c}) out.put(value);
    return pose.take("tf2_msgs/TFMessage", reader(out), UnixTime{}, logs);
  };
  ASSERT_TRUE(take("odom", "base_link", 0, 1, 0, 0)) << "before anything says where odom is";
  ASSERT_TRUE(take("map", "odom", 50, 10, 1, c));
  ASSERT_TRUE(take("odom", "base_link", 100, 2, 0, 0));
  ASSERT_TRUE(take("odom", "base_link", 200, 3, 0, 0));
  const auto solutions = all_of<InsSolution>(decoded(logs));
  ASSERT_EQ(solutions.size(), 2u);
  EXPECT_EQ(solutions[1].time, from_unix(UnixTime(nanoseconds(kBegin_ns + 200'000'000))));
  EXPECT_NEAR(solutions[1].position.ellipsoidal_height, 121, 1e-4);
  EXPECT_NEAR(solutions[1].velocity_enu.y(), 10, 1e-4) << "odom is turned to the left, so its x is north";
  EXPECT_NEAR(std::remainder(solutions[1].attitude.heading, 2 * std::numbers::pi), 0, 1e-6);
}

TEST(RosPose, ReadsPositionsOfGpsFix) {
  const auto fix_of = [](std::int16_t status) {
    test::RosWriter out(RosEncoding::Cdr);
    out.header(kBegin_ns, "gps").header(kBegin_ns, "").put(std::uint16_t{2});
    out.put(std::uint32_t{2}).put(std::int32_t{5}).put(std::int32_t{7}).put(std::uint16_t{3});
    for (int i = 0; i < 4; ++i) out.put(std::uint32_t{1}).put(std::int32_t{9});
    out.put(status);
    for (int i = 0; i < 3; ++i) out.put(std::uint16_t{1});
    out.put(10.0).put(20.0).put(100.0);
    for (int i = 0; i < 22; ++i) out.put(-1.0);
    for (const double variance : {4.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 16.0}) out.put(variance);
    return out.put(std::uint8_t{2});
  };
  for (const char* type : {"gps_common/GPSFix", "gps_msgs/GPSFix"}) {
    const auto position = drivers::take_position(type, reader(fix_of(19)));
    ASSERT_TRUE(position);
    EXPECT_EQ(count_ns(position->time), kBegin_ns);
    EXPECT_NEAR(position->place.longitude, 20 * kDegree, 1e-12);
    EXPECT_EQ(position->place.ellipsoidal_height, 100);
    ASSERT_TRUE(position->sigma_enu);
    EXPECT_TRUE(position->sigma_enu->isApprox(Eigen::Vector3d(2, 3, 4)));
    EXPECT_FALSE(drivers::take_position(type, reader(fix_of(-1)))) << "without a fix";
  }
}

TEST(RosPose, CountsTheTimeOfASimulatorFromADate) {
  const nanoseconds shift = std::chrono::seconds(1'577'836'800);
  RosPose pose(RosPoseRank::Part, {}, shift);
  std::vector<RosPose::Logs> logs;
  const auto ms = [](std::int64_t count) { return count * 1'000'000; };
  const auto take = [&](const char* type, const test::RosWriter& message, std::int64_t recorded_ms) {
    return pose.take(type, reader(message), UnixTime(nanoseconds(ms(recorded_ms))), logs);
  };
  ASSERT_TRUE(take("sensor_msgs/NavSatFix", fix(ms(1000), 10, 20, 100), 1000));
  ASSERT_TRUE(take("sensor_msgs/Imu", imu(ms(1500), {0, 0, 0, 1}), 1500));
  ASSERT_TRUE(take("sensor_msgs/Imu", imu(0, {0, 0, 0, 1}), 1600)) << "without a stamp it has the recorder's time";
  ASSERT_TRUE(take("sensor_msgs/Imu", imu(kBegin_ns, {0, 0, 0, 1}), 1700));
  ASSERT_TRUE(take("sensor_msgs/NavSatFix", fix(ms(2000), 10, 20, 104), 2000));
  pose.finish(logs);
  const auto solutions = all_of<InsSolution>(decoded(logs));
  ASSERT_EQ(solutions.size(), 2u);
  EXPECT_EQ(solutions[0].time, from_unix(UnixTime(shift + nanoseconds(ms(1500)))));
  EXPECT_EQ(count_ns(solutions[0].received), ms(1503));
  EXPECT_EQ(solutions[1].time, from_unix(UnixTime(shift + nanoseconds(ms(1600)))));
  EXPECT_EQ(pose.dropped().at("sensor_msgs/Imu").of_other_clock, 1u);
}

TEST(RosPose, MessagesCutAnywhereAreRefused) {
  const std::string whole = fix(kBegin_ns, 10, 20, 30).bytes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::string cut = whole.substr(0, size);
    RosPose pose(RosPoseRank::Part, {});
    std::vector<RosPose::Logs> logs;
    const RosReader in(std::as_bytes(std::span(cut)), RosEncoding::Cdr);
    EXPECT_FALSE(pose.take("sensor_msgs/NavSatFix", in, UnixTime{}, logs)) << "cut to " << size;
  }
}

}  // namespace
}  // namespace hueline
