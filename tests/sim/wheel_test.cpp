// The wheel encoder: its distances against the velocity of the motion, its frames against their description, and its
// bus on a socket.
#include "sim/wheel_model.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <cstring>

#include "sim/devices/can_sender.hpp"
#include "sim/wire/can_encode.hpp"
#include "sim/wire/timeline.hpp"

namespace hueline::sim {
namespace {

Scenario bend() {
  Scenario s;
  s.duration_s = 30;
  s.street.curve_deg = 50;
  s.street.curve_start_m = 30;
  s.wheel.rate_hz = 50;
  s.noise = false;
  return s;
}

TEST(WheelModel, CountsTheWayThatTheVelocityGoes) {
  const Scenario s = bend();
  const Motion motion(s);
  const auto samples = simulate_wheel(s, motion);
  ASSERT_EQ(samples.size(), static_cast<std::size_t>((s.end_gps_ns() - s.begin_gps_ns()) / 20'000'000 + 1));
  // The expected distance is integrated in small steps from velocity and heading, which the model does not use.
  double way = 0, turned = 0, by_speed = 0;
  double heading = motion.state(s.begin_gps_ns()).heading;
  for (GpsNs t = s.begin_gps_ns(); t < s.end_gps_ns(); t += 1'000'000) {
    const TrueState state = motion.state(t + 500'000);
    way += std::hypot(state.velocity_enu.x, state.velocity_enu.y) * 1e-3;
    turned += std::remainder(state.heading - heading, 2 * kPi);
    heading = state.heading;
  }
  EXPECT_GT(way, 100);
  EXPECT_NEAR(turned, radians(50), 1e-6);
  for (const WheelSample& sample : samples) by_speed += (sample.speed[2] + sample.speed[3]) / 2 * 0.02;
  EXPECT_NEAR(by_speed, way, 0.01);
  const double per_pulse = s.wheel.circumference_m / s.wheel.pulses_per_turn;
  const double left = samples.back().pulses[0] * per_pulse, right = samples.back().pulses[1] * per_pulse;
  EXPECT_NEAR((left + right) / 2, way, 0.03);
  EXPECT_NEAR(left - right, turned * s.wheel.track_m, 0.05) << "the bend goes to the right: the left wheel is outside";
  for (const WheelSample& sample : samples)
    for (std::size_t side = 0; side < 2; ++side)
      EXPECT_GE(sample.speed[side], sample.speed[2 + side] - 1e-12) << "front wheels go the wider bend";
}

TEST(WheelModel, ScaleNoiseAndAbsence) {
  Scenario s = bend();
  const Motion motion(s);
  const auto plain = simulate_wheel(s, motion);
  s.wheel.scale = 1.1;
  EXPECT_NEAR(simulate_wheel(s, motion).back().pulses[0], 1.1 * plain.back().pulses[0], 1.5);
  s.wheel.scale = 1;
  s.noise = true;
  const auto noisy = simulate_wheel(s, motion);
  double squares = 0;
  int moving = 0;
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    if (plain[i].speed[2] < 1) continue;
    squares += std::pow(noisy[i].speed[2] - plain[i].speed[2], 2);
    ++moving;
  }
  EXPECT_NEAR(std::sqrt(squares / moving), 0.01, 0.001);
  EXPECT_EQ(noisy.front().speed[2], 0) << "standing wheels say nothing";
  s.wheel.rate_hz = 0;
  EXPECT_TRUE(simulate_wheel(s, motion).empty());
}

TEST(CanEncode, FramesAreAsDescribed) {
  WheelSample sample;
  sample.speed = {1, 2, 50 / 3.6, 0.0075 / 3.6};
  sample.pulses = {0x12345, 0x00FE};
  const Bytes speeds = encode_wheel_speeds(sample);
  ASSERT_EQ(speeds.size(), kCanFrameBytes);
  EXPECT_EQ(speeds[0], std::byte{178});
  EXPECT_EQ(speeds[4], std::byte{8});
  EXPECT_EQ(std::to_integer<int>(speeds[8]) | std::to_integer<int>(speeds[9]) << 8, 6667);   // rear left, 50 km/h
  EXPECT_EQ(speeds[10], std::byte{1});                                                       // rear right
  EXPECT_EQ(std::to_integer<int>(speeds[12]) | std::to_integer<int>(speeds[13]) << 8, 480);  // front left, 3.6 km/h
  const Bytes pulses = encode_wheel_pulses(sample, 0x2B);
  EXPECT_EQ(pulses[0], std::byte{0xA0});
  EXPECT_EQ(pulses[1], std::byte{0x01});
  EXPECT_EQ(pulses[8], std::byte{0x23});
  EXPECT_EQ(pulses[9], std::byte{0x45});
  EXPECT_EQ(pulses[11], std::byte{0xFE});
  EXPECT_EQ(pulses[12], std::byte{0x0B});
}

TEST(CanSender, TheBusIsHeardAsAGatewaysDatagrams) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  socklen_t size = sizeof(address);
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  CanSender::Config config;
  config.port = ntohs(address.sin_port);
  auto sender = CanSender::open(config);
  ASSERT_TRUE(sender.ok()) << sender.error().message;
  WheelSample sample;
  sample.speed.fill(10);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE((*sender)->send(encode_wheel_speeds(sample)));
  for (int i = 0; i < 3; ++i) {
    unsigned char heard[64];
    ASSERT_EQ(::recv(fd, heard, sizeof(heard), 0), 18);
    const unsigned char head[10] = {2, 0, static_cast<unsigned char>(i), 0, 1, 0, 0, 0, 0xB2, 8};
    EXPECT_EQ(std::memcmp(heard, head, sizeof(head)), 0) << i;
    EXPECT_EQ(heard[10] | heard[11] << 8, 4800);  // 36 km/h
  }
  ::close(fd);
  config.interface = "hueline_none";
  EXPECT_FALSE(CanSender::open(config).ok());
  config.interface = "a_name_that_is_too_long";
  EXPECT_NE(config.validate(), "");
}

}  // namespace
}  // namespace hueline::sim
