// Frames of an MTi on a CAN bus, made here by hand after the maker's description.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/angle.hpp"
#include "core/calendar.hpp"
#include "drivers/xsens/xsens_can_decoder.hpp"
#include "tests/drivers/can/can_frames.hpp"

namespace hueline::drivers {
namespace {

using test::can_frame;
using test::can_packet;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint32_t kFixed = 2 | 4;  // status: filter valid, GNSS fix

/// A frame with whole numbers of `size` bytes each, the most significant byte first.
CanFrame big(std::uint32_t id, std::size_t size, std::initializer_list<std::int64_t> values) {
  CanFrame frame;
  frame.id = id;
  for (const std::int64_t value : values)
    for (std::size_t i = size; i-- > 0;)
      frame.data[frame.length++] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
  return frame;
}
CanFrame sample_time(std::uint32_t ticks) { return big(0x05, 4, {ticks}); }
CanFrame group(int counter) { return big(0x06, 2, {counter}); }
/// 2026-03-01 12:00 UTC and `tenth_ms` later.
CanFrame utc(int second, int tenth_ms) {
  return can_frame(0x07, {26, 3, 1, 12, 0, second, tenth_ms / 256, tenth_ms % 256});
}
CanFrame status(std::uint32_t word = kFixed) { return big(0x11, 4, {word}); }
/// Nose to the north, level: 90 deg about up, from east.
CanFrame quaternion() { return big(0x21, 2, {23170, 0, 0, 23170}); }
/// Roll 1, pitch 2, yaw 90 deg.
CanFrame euler() { return big(0x22, 2, {128, 256, 90 * 128}); }
CanFrame rate() { return big(0x32, 2, {51, -102, 154}); }
CanFrame acceleration() { return big(0x34, 2, {256, -512, 2510}); }
/// 47.5 N, 8.25 W, 450.5 m.
CanFrame place() { return big(0x71, 4, {std::int64_t{95} << 23, -(std::int64_t{33} << 21)}); }
CanFrame height(double metres = 450.5) { return big(0x72, 4, {std::llround(metres * 32768)}); }
CanFrame velocity() { return big(0x76, 2, {256, -192, 32}); }

struct Heard {
  std::vector<Measurement> measurements;
  DecodeCounts counts;
  std::size_t bytes = 0;

  template <class T>
  std::vector<T> all() const {
    std::vector<T> out;
    for (const Measurement& m : measurements)
      if (const T* one = std::get_if<T>(&m)) out.push_back(*one);
    return out;
  }
  std::vector<std::string> faults() const {
    std::vector<std::string> out;
    for (const Fault& fault : all<Fault>())
      out.push_back(std::string(name(fault.kind)) + " " + std::to_string(fault.count) + ": " + fault.detail);
    return out;
  }
};

/// Decodes frames that come every millisecond.
Heard hear(const std::vector<CanFrame>& frames) {
  XsensCanDecoder decoder;
  Heard out;
  double at_s = 10;
  for (const CanFrame& frame : frames) {
    const Packet packet = can_packet(frame, at_s += 0.001);
    out.bytes += packet.bytes.size();
    decoder.decode(packet, out.measurements);
  }
  decoder.flush(out.measurements);
  out.counts = decoder.counts();
  EXPECT_EQ(out.counts.decoded_bytes + out.counts.ignored_bytes + out.counts.malformed_bytes, out.bytes);
  return out;
}

TEST(XsensCan, SolutionsAndInertialSamplesInOurAxes) {
  const Heard heard = hear({sample_time(5'000), group(1), utc(5, 1234),   status(),   quaternion(), euler(), rate(),
                            acceleration(),     place(),  height(),       velocity(),  //
                            sample_time(5'100), group(2), utc(5, 1334),   status(),   quaternion(), euler(), rate(),
                            acceleration(),     place(),  height(-12.25), velocity()});
  const auto all = heard.all<InsSolution>();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].time, *from_utc({2026, 3, 1, 12, 0, 5, 123'400'000}));
  EXPECT_EQ(all[1].time, *from_utc({2026, 3, 1, 12, 0, 5, 133'400'000}));
  EXPECT_EQ(all[0].received, HostTime(from_seconds(10.011))) << "when its last frame came";
  EXPECT_TRUE(all[0].is_good);
  EXPECT_EQ(all[0].status, kFixed);
  EXPECT_DOUBLE_EQ(all[0].position.latitude, 47.5 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(all[0].position.longitude, -8.25 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(all[0].position.ellipsoidal_height, 450.5);
  EXPECT_DOUBLE_EQ(all[1].position.ellipsoidal_height, -12.25) << "below the ellipsoid";
  EXPECT_NEAR(std::remainder(all[0].attitude.heading, 2 * std::numbers::pi), 0, 1e-4);
  EXPECT_NEAR(all[0].attitude.pitch, 0, 1e-4);
  EXPECT_NEAR(all[0].velocity_enu.x(), 4, 1e-9);
  EXPECT_NEAR(all[0].velocity_enu.y(), -3, 1e-9);
  EXPECT_NEAR(all[0].velocity_enu.z(), 0.5, 1e-9);
  const auto samples = heard.all<ImuSample>();
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_NEAR(samples[0].specific_force_body.x(), 2, 1e-9) << "right is minus left";
  EXPECT_NEAR(samples[0].specific_force_body.y(), 1, 1e-9);
  EXPECT_NEAR(samples[0].specific_force_body.z(), 2510.0 / 256, 1e-9);
  EXPECT_NEAR(samples[0].angular_rate_body.x(), 102.0 / 512, 1e-9);
  EXPECT_NEAR(samples[0].angular_rate_body.y(), 51.0 / 512, 1e-9);
  ASSERT_EQ(heard.all<TimeLabel>().size(), 1u);
  EXPECT_THAT(heard.faults(), ElementsAre());
}

TEST(XsensCan, EulerAnglesServeWhereThereIsNoQuaternion) {
  const auto all = hear({utc(5, 0), status(), euler(), place(), height(), velocity()}).all<InsSolution>();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NEAR(std::remainder(all[0].attitude.heading, 2 * std::numbers::pi), 0, 1e-6);
  EXPECT_NEAR(all[0].attitude.pitch, -2 * kRadPerDeg, 1e-6);
  EXPECT_NEAR(all[0].attitude.roll, 1 * kRadPerDeg, 1e-6);
}

TEST(XsensCan, TheDevicesClockCarriesATimeOnToSamplesWithoutUtc) {
  std::vector<CanFrame> frames;
  // UTC with each tenth sample only; the device's clock wraps meanwhile.
  for (std::uint32_t i = 0; i < 30; ++i) {
    frames.push_back(sample_time(0xFFFF'FF00U + i * 100));
    if (i % 10 == 0) frames.push_back(utc(5, static_cast<int>(i) * 100));
    frames.push_back(status());
    frames.push_back(rate());
    frames.push_back(acceleration());
  }
  const Heard heard = hear(frames);
  const auto all = heard.all<ImuSample>();
  ASSERT_EQ(all.size(), 30u);
  for (std::size_t i = 0; i < all.size(); ++i)
    EXPECT_EQ(all[i].time, *from_utc({2026, 3, 1, 12, 0, 5, 0}) + std::chrono::milliseconds(10 * i)) << i;
  EXPECT_THAT(heard.faults(), ElementsAre());
}

TEST(XsensCan, WithoutATimeThatGnssHasSetNothingIsStamped) {
  const Heard unfixed = hear({utc(5, 0), status(2), rate(), acceleration(), utc(5, 100), status(2), rate(),
                              acceleration(), utc(5, 200), status(), rate(), acceleration()});
  EXPECT_EQ(unfixed.all<ImuSample>().size(), 1u);
  EXPECT_EQ(unfixed.all<TimeLabel>().size(), 1u);
  EXPECT_THAT(unfixed.faults(), ElementsAre(HasSubstr("NoTime 1: no GNSS fix has set the device's time")));
  const Heard untimed = hear({status(), rate(), acceleration(), status(), rate(), acceleration()});
  EXPECT_TRUE(untimed.all<ImuSample>().empty());
  EXPECT_THAT(untimed.faults(), ElementsAre(HasSubstr("NoTime 1: no UTC: let the device send UTC")));
  // A fix that is lost: the device's clock goes on, but it labels no second and its solution is not good.
  const Heard lost = hear({utc(5, 0), status(), quaternion(), place(), height(), velocity(), utc(6, 0), status(2),
                           quaternion(), place(), height(), velocity()});
  const auto all = lost.all<InsSolution>();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_TRUE(all[0].is_good);
  EXPECT_FALSE(all[1].is_good);
  EXPECT_EQ(lost.all<TimeLabel>().size(), 1u);
}

TEST(XsensCan, LossesAreTold) {
  const Heard heard = hear({group(65534), rate(), group(2), rate(), can_frame(0x01, {1}), group(3),
                            can_frame(0x32, {1, 2, 3}), can_frame(0x41, {1, 2, 3, 4, 5, 6}), test::can_error(0x40)});
  EXPECT_THAT(heard.faults(),
              ElementsAre("Lost 3: 3 samples are missing, by their group counter",
                          HasSubstr("Lost 1: the device lost at least one message, because its buffer"),
                          "Malformed 1: message 032 has 3 bytes, an MTi's has 6", HasSubstr("Disconnected 1")));
  EXPECT_GT(heard.counts.ignored_bytes, 0u) << "the magnetic field is not used";
}

TEST(XsensCan, IdentifiersOf29BitsAreTheSame) {
  CanFrame frame = rate(), other = acceleration();
  frame.is_extended = other.is_extended = true;
  EXPECT_EQ(hear({utc(5, 0), status(), frame, other}).all<ImuSample>().size(), 1u);
}

TEST(XsensCan, AnyFramesAreCountedOnce) {
  std::mt19937 random(11);
  constexpr std::uint32_t kIds[] = {1,    5,    6,    7,    0x11, 0x21, 0x22, 0x32,
                                    0x34, 0x61, 0x62, 0x71, 0x72, 0x76, 0x41, 0x7FF};
  for (int turn = 0; turn < 200; ++turn) {
    std::vector<CanFrame> frames;
    for (int i = 0; i < 100; ++i) {
      CanFrame frame;
      frame.id = kIds[random() % std::size(kIds)];
      frame.length = static_cast<std::uint8_t>(random() % 9);
      for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
      frame.is_remote = random() % 20 == 0;
      if (random() % 4 == 0)
        frame = std::initializer_list<CanFrame>{utc(5, i), status(), quaternion(), place()}.begin()[random() % 4];
      frames.push_back(frame);
    }
    for (const InsSolution& solution : hear(frames).all<InsSolution>()) {
      EXPECT_TRUE(std::isfinite(solution.position.ellipsoidal_height) && std::isfinite(solution.attitude.heading));
      EXPECT_LE(std::abs(solution.position.latitude), std::numbers::pi / 2);
    }
  }
}

}  // namespace
}  // namespace hueline::drivers
