#include "drivers/wheel/wheel_decoder.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <map>

#include "tests/drivers/can/can_frames.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::can_error;
using test::can_frame;
using test::can_packet;

CanSignal signal(int start, int bits, double scale = 1) {
  CanSignal out;
  out.start_bit = start;
  out.bits = bits;
  out.scale = scale;
  return out;
}

/// Message 0B2 has two speeds of 0.01 m/s, a counter of 4 bits in byte 4 and a check sum in byte 5. Message 1A0 has two
/// counts of pulses of 2 cm.
WheelDecoder::Config config() {
  WheelDecoder::Config out;
  WheelDecoder::Message speeds;
  speeds.id = 0xB2;
  for (const int start : {0, 16}) speeds.speeds.push_back(signal(start, 16, 0.01));
  speeds.counter = signal(32, 4);
  speeds.checksum = WheelDecoder::Checksum{CanChecksum::Xor, 5};
  WheelDecoder::Message pulses;
  pulses.id = 0x1A0;
  for (const int start : {0, 8}) pulses.pulses.push_back({signal(start, 8), 0.02});
  out.messages = {speeds, pulses};
  return out;
}

struct Decoded {
  WheelDecoder decoder;
  std::vector<WheelSpeed> wheels;
  std::map<FaultKind, std::uint64_t> faults;
  std::string last_fault;
  std::uint64_t bytes = 0;

  explicit Decoded(WheelDecoder::Config c = config()) : decoder(std::move(c)) {}
  void collect(std::vector<Measurement>& out) {
    for (Measurement& m : out) {
      if (auto* wheel = std::get_if<WheelSpeed>(&m)) wheels.push_back(*wheel);
      if (auto* fault = std::get_if<Fault>(&m)) {
        faults[fault->kind] += fault->count;
        last_fault = fault->detail;
      }
    }
  }
  void take(const Packet& packet) {
    std::vector<Measurement> out;
    bytes += packet.bytes.size();
    decoder.decode(packet, out);
    collect(out);
  }
  void take(const CanFrame& frame, double at_s) { take(can_packet(frame, at_s)); }
  void end() {
    std::vector<Measurement> out;
    decoder.flush(out);
    collect(out);
    const DecodeCounts& c = decoder.counts();
    EXPECT_EQ(c.decoded_bytes + c.ignored_bytes + c.malformed_bytes, bytes);
  }
};

CanFrame speeds(int left, int right, int counter) {
  CanFrame frame = can_frame(0xB2, {left & 255, left >> 8, right & 255, right >> 8, counter & 15, 0});
  for (std::size_t i = 0; i < 5; ++i) frame.data[5] = static_cast<std::uint8_t>(frame.data[5] ^ frame.data[i]);
  return frame;
}

TEST(WheelDecoder, AMessageIsTheMeanOfItsWheels) {
  ASSERT_EQ(config().validate(), "");
  Decoded d;
  d.take(speeds(1000, 1020, 3), 5.0);
  d.end();
  ASSERT_EQ(d.wheels.size(), 1u);
  EXPECT_EQ(d.wheels[0].sensor, 3);
  EXPECT_DOUBLE_EQ(*d.wheels[0].speed, 10.1);
  EXPECT_EQ(d.wheels[0].received, HostTime(std::chrono::seconds(5)));
  EXPECT_FALSE(d.wheels[0].distance_m);
  EXPECT_FALSE(d.wheels[0].is_directional);
  EXPECT_TRUE(d.faults.empty());
}

TEST(WheelDecoder, GapsAndRepeatsOfTheCounterAreTold) {
  Decoded d;
  for (int i = 0; i < 40; ++i) {
    if (i == 10 || i == 11 || i == 30) continue;
    d.take(speeds(1000, 1000, i), 5 + 0.02 * i);
    if (i == 20) d.take(speeds(1000, 1000, i), 5.401);
  }
  d.end();
  EXPECT_EQ(d.wheels.size(), 37u);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 3}, {FaultKind::Spurious, 1}}));
}

TEST(WheelDecoder, ACounterMayHaveARangeOfItsOwn) {
  WheelDecoder::Config c = config();
  c.messages[0].counter->min = 1;
  c.messages[0].counter->max = 15;
  Decoded d(c);
  for (int i = 0; i < 45; ++i) d.take(speeds(1000, 1000, 1 + i % 15), 5 + 0.02 * i);
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
  d.take(speeds(1000, 1000, 0), 6);
  d.end();
  EXPECT_EQ(d.wheels.size(), 45u);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Implausible, 1}}));
}

TEST(WheelDecoder, WhatIsNoSpeedIsNotUsed) {
  WheelDecoder::Config c = config();
  for (CanSignal& s : c.messages[0].speeds) s.max = 60;
  Decoded d(c);
  d.take(speeds(1000, 0xFFFF, 0), 1.00);  // one wheel has no value: the other speaks
  d.take(speeds(0xFFFF, 0xFFFF, 1), 1.02);
  d.take(speeds(3000, 3000, 2), 1.04);  // 10 to 30 m/s in 0.04 s
  d.take(speeds(1010, 1010, 3), 1.06);
  d.end();
  ASSERT_EQ(d.wheels.size(), 2u);
  EXPECT_DOUBLE_EQ(*d.wheels[0].speed, 10.0);
  EXPECT_DOUBLE_EQ(*d.wheels[1].speed, 10.1);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Implausible, 4}}));
  // A speed that stays is accepted in the end.
  for (int i = 4; i < 24; ++i) d.take(speeds(3000, 3000, i), 1.0 + 0.02 * i);
  EXPECT_DOUBLE_EQ(*d.wheels.back().speed, 30.0);
}

TEST(WheelDecoder, BrokenAndShortMessagesAreMalformed) {
  Decoded d;
  CanFrame wrong = speeds(1000, 1000, 1);
  wrong.data[5] ^= 1;
  d.take(wrong, 1);
  CanFrame cut = speeds(1000, 1000, 2);
  cut.length = 5;
  d.take(cut, 3);
  Packet garbage = can_packet(cut, 5);
  garbage.bytes = Buffer::copy_of(test::bytes_of({9, 9, 9}));
  d.take(garbage);
  d.take(can_frame(0x123, {1, 2, 3}), 6);  // another control unit's
  d.end();
  EXPECT_TRUE(d.wheels.empty());
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Malformed, 3}}));
  EXPECT_EQ(d.decoder.counts().messages.at("123"), 1u);
  EXPECT_EQ(d.decoder.counts().ignored_bytes, 32u);
}

TEST(WheelDecoder, PulsesWrapAndRollBack) {
  Decoded d;
  int left = 250, right = 10;
  double at = 1;
  const auto turn = [&](int by) {
    left = (left + by) & 255;
    right = (right + by) & 255;
    d.take(can_frame(0x1A0, {left, right}), at += 0.02);
    return *d.wheels.back().distance_m;
  };
  EXPECT_DOUBLE_EQ(turn(0), 0);
  EXPECT_NEAR(turn(20), 0.4, 1e-12);
  for (int i = 0; i < 50; ++i) turn(20);
  EXPECT_NEAR(*d.wheels.back().distance_m, 51 * 0.4, 1e-9);
  EXPECT_NEAR(turn(-5), 51 * 0.4 - 0.1, 1e-9);
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
  at += 1;  // 70 m/s could have turned it 27 times
  EXPECT_NEAR(turn(77), 51 * 0.4 - 0.1, 1e-9);
  EXPECT_NEAR(turn(5), 51 * 0.4, 1e-9);
  d.end();
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 50}, {FaultKind::Implausible, 1}}))
      << "messages by their cycle, and the distance";
}

TEST(WheelDecoder, BusOffIsToldOnceAndItsEndToo) {
  Decoded d;
  d.take(speeds(0, 0, 1), 1.0);
  d.take(can_error(CAN_ERR_BUSOFF), 1.1);
  d.take(can_error(CAN_ERR_BUSOFF), 1.2);
  d.take(can_error(CAN_ERR_RESTARTED), 3.0);
  d.take(speeds(0, 0, 2), 3.1);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Disconnected, 1}, {FaultKind::Reconnected, 1}}));
  // Without an error frame about the restart, the next frame shows it.
  d.take(can_error(CAN_ERR_BUSOFF), 4.0);
  d.take(speeds(0, 0, 3), 5.0);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Disconnected, 2}, {FaultKind::Reconnected, 2}}));
  for (int i = 0; i < 100; ++i) d.take(can_error(CAN_ERR_PROT | CAN_ERR_BUSERROR), 6 + 0.001 * i);  // a storm
  d.end();
  EXPECT_EQ(d.faults[FaultKind::Malformed], 100u);
}

/// The same on a slow vehicle, whose pulses do not wrap within 0.1 s.
WheelDecoder::Config slow() {
  WheelDecoder::Config out = config();
  out.max_speed = 20;
  return out;
}

TEST(WheelDecoder, MessagesThatWaitedAreNotLost) {
  Decoded d(slow());
  double at = 1;
  int left = 0;
  const auto turn = [&](double after) { d.take(can_frame(0x1A0, {left = (left + 1) & 255, 0}), at += after); };
  for (int i = 0; i < 40; ++i) turn(0.02);
  // Three waited in an adapter and came together.
  turn(0.06);
  for (int i = 0; i < 2; ++i) turn(0.0002);
  for (int i = 0; i < 40; ++i) turn(0.02);
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
  // Of three, two came.
  turn(0.06);
  turn(0.0002);
  for (int i = 0; i < 7; ++i) turn(0.02);
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
  turn(0.02);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 1}})) << d.last_fault;
  turn(0.06);
  for (int i = 0; i < 10; ++i) turn(0.0002);  // more than were awaited
  for (int i = 0; i < 40; ++i) turn(0.02);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 1}})) << d.last_fault;
  // What is awaited at the end does not come.
  turn(0.06);
  d.end();
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 3}})) << d.last_fault;
}

/// The computer stalls for 0.4 s, reads some of what waited, stalls again, and reads the rest as it finds the time.
TEST(WheelDecoder, MessagesThatWaitedForABusyComputerAreNotLost) {
  Decoded d(slow());
  double at = 1;
  const auto turn = [&](double after) { d.take(can_frame(0x1A0, {0, 0}), at += after); };
  const auto stall = [&](int lost) {
    turn(20 * 0.02);
    for (int i = 0; i < 9 - lost; ++i) turn(0.0002);
    for (int i = 0; i < 3; ++i) turn(0.02);
    turn(5 * 0.02);
    for (int i = 0; i < 14; ++i) turn(i % 5 == 0 ? 0.02 : 0.0002);
    for (int i = 0; i < 3; ++i) turn(0.0002);
    for (int i = 0; i < 20; ++i) turn(0.02);
  };
  for (int i = 0; i < 40; ++i) turn(0.02);
  stall(0);
  EXPECT_EQ(d.faults[FaultKind::Lost], 0u) << d.last_fault;
  stall(2);
  EXPECT_EQ(d.faults[FaultKind::Lost], 2u) << d.last_fault;
  d.end();
  EXPECT_EQ(d.faults[FaultKind::Lost], 2u) << d.last_fault;
}

/// A counter of 16 does not show whether as many are lost or late.
TEST(WheelDecoder, MessagesThatWaitedForATurnOfTheirCounterAreNotLost) {
  Decoded d(slow());
  double at = 1;
  int count = 0;
  const auto next = [&](double after) { d.take(speeds(100, 100, count++), at += after); };
  for (int i = 0; i < 64; ++i) next(0.02);
  // Sixteen waited while the computer was busy, and came together.
  next(17 * 0.02);
  for (int i = 0; i < 16; ++i) next(0.0002);
  for (int i = 0; i < 64; ++i) next(0.02);
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
  // Sixteen are lost.
  count += 16;
  next(17 * 0.02);
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
  for (int i = 0; i < 8; ++i) next(0.02);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 16}})) << d.last_fault;
  // Of eighteen, one is lost among those that waited.
  next(19 * 0.02);
  for (int i = 0; i < 17; ++i) {
    if (i == 9) ++count;
    next(0.0002);
  }
  for (int i = 0; i < 64; ++i) next(0.02);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 17}})) << d.last_fault;
  // Eighteen are lost at the end: two by the counter, and sixteen when nothing comes any more.
  count += 18;
  next(19 * 0.02);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 19}})) << d.last_fault;
  d.end();
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 35}})) << d.last_fault;
}

/// A counter of 62 bits that counts down has lost nearly 2^62 messages each time: no sum of that may overflow.
TEST(WheelDecoder, AWideCounterMayTellOfAnyNumber) {
  WheelDecoder::Config wide = config();
  wide.messages.resize(1);
  wide.messages[0] = {};
  wide.messages[0].id = 0x64;
  wide.messages[0].pulses.push_back({signal(0, 8), 0.02});
  wide.messages[0].counter = signal(0, 62);
  Decoded d(wide);
  for (int i = 0; i < 10; ++i) d.take(can_frame(0x64, {100 - i, 0, 0, 0, 0, 0, 0, 0}), 1 + 0.001 * i);
  d.end();
  EXPECT_EQ(d.wheels.size(), 10u);
  EXPECT_EQ(d.faults.count(FaultKind::Lost), 1u);
}

/// The messages come 20 ms apart with the jitter of an interrupt. Single ones of each are lost, and bus-off takes two
/// seconds of both.
TEST(WheelDecoder, LossesAreCountedByTheCycleWhereNoCounterCan) {
  Decoded d(slow());
  std::uint64_t lost = 0, sent = 0;
  for (int i = 0; i < 600; ++i) {
    const double at_s = 1 + 0.02 * i + 0.0004 * (i % 7);
    const bool is_off = i >= 300 && i<400, is_lost = i> 30 && i % 37 == 0;
    if (i == 300) d.take(can_error(CAN_ERR_BUSOFF), at_s);
    if (i == 399) d.take(can_error(CAN_ERR_RESTARTED), at_s);
    for (const bool is_pulses : {false, true}) {
      ++sent;
      if (is_off || is_lost) {
        ++lost;
        continue;
      }
      d.take(is_pulses ? can_frame(0x1A0, {i & 255, i & 255}) : speeds(100, 100, i), at_s + 0.001 * is_pulses);
    }
  }
  d.end();
  EXPECT_EQ(d.wheels.size(), sent - lost);
  EXPECT_EQ(d.faults[FaultKind::Lost], lost);
  EXPECT_EQ(d.faults[FaultKind::Implausible], 1u) << "pulses may have wrapped meanwhile";
}

TEST(WheelDecoder, AMessageWithoutACycleIsNotMissed) {
  Decoded d(slow());
  std::uint64_t random = 1;
  double at_s = 1;
  for (int i = 0; i < 300; ++i) {
    random = random * 6364136223846793005u + 1442695040888963407u;
    d.take(can_frame(0x1A0, {i & 255, i & 255}), at_s += 0.002 + 0.06 * static_cast<double>(random >> 40) / (1 << 24));
  }
  d.end();
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
}

TEST(WheelDecoder, ACycleThatBecomesAnotherIsLearned) {
  Decoded d(slow());
  for (int i = 0; i < 100; ++i) d.take(can_frame(0x1A0, {0, 0}), 1 + 0.02 * i);
  for (int i = 0; i < 100; ++i) d.take(can_frame(0x1A0, {0, 0}), 3 + 0.04 * i);
  d.end();
  EXPECT_LE(d.faults[FaultKind::Lost], 64u);
}

TEST(WheelDecoder, DatagramsOfAGatewayAreCounted) {
  Decoded d;
  const auto datagram = [&](int number, int counter, double at_s) {
    const CanFrame frame = speeds(1000, 1000, counter);
    std::vector<std::byte> bytes = test::bytes_of({2, 0, number & 255, 0, 1, 0, 0, 0, 0xB2, 6});
    for (const std::uint8_t byte : frame.bytes()) bytes.push_back(static_cast<std::byte>(byte));
    Packet packet = can_packet(frame, at_s);
    packet.bytes = Buffer::copy_of(bytes);
    d.take(packet);
  };
  for (int i = 250; i < 262; ++i) datagram(i, i, 0.02 * i);
  EXPECT_TRUE(d.faults.empty()) << d.last_fault;
  datagram(265, 265, 5.3);
  datagram(265, 265, 5.31);
  datagram(264, 264, 5.32);
  d.end();
  EXPECT_EQ(d.wheels.size(), 13u);
  EXPECT_EQ(d.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 3 + 3}, {FaultKind::Spurious, 2}}));
}

TEST(WheelDecoder, SignalsOfARealLogAreThoseOfAnotherReader) {
  HUELINE_REQUIRE_DATA("can/issue_1256.asc");
  // Bytes 0 and 1 of 011 are read as if they had 0.001 m/s; bits 3 to 7 of 064 count its messages. The expected figures
  // come from a few lines of Python.
  WheelDecoder::Config first, second;
  first.messages.resize(1);
  first.messages[0].id = 0x11;
  first.messages[0].speeds = {signal(0, 16, 0.001)};
  second.messages.resize(1);
  second.messages[0].id = 0x64;
  second.messages[0].speeds = {signal(8, 8, 1e-3)};
  second.messages[0].counter = signal(3, 5);
  Decoded values(first), counted(second);
  std::vector<Fault> faults;
  for (const Packet& packet : test::read_can_log(data_file.string(), faults)) {
    values.take(packet);
    counted.take(packet);
  }
  values.end();
  counted.end();
  double sum = 0;
  for (const WheelSpeed& wheel : values.wheels) sum += *wheel.speed;
  EXPECT_EQ(values.wheels.size(), 265u);
  EXPECT_NEAR(sum / 265, 11.763154716981132, 1e-9);
  EXPECT_TRUE(values.faults.empty()) << values.last_fault;
  EXPECT_EQ(counted.wheels.size(), 795u);
  EXPECT_EQ(counted.faults, (std::map<FaultKind, std::uint64_t>{{FaultKind::Lost, 196}}));
}

TEST(WheelDecoder, ConfigIsChecked) {
  const auto wrong = [](auto change) {
    WheelDecoder::Config c = config();
    change(c);
    return c.validate();
  };
  EXPECT_NE(wrong([](auto& c) { c.messages.clear(); }), "");
  EXPECT_NE(wrong([](auto& c) { c.messages[0].id = 0x800; }), "");
  EXPECT_NE(wrong([](auto& c) { c.messages[1].id = c.messages[0].id; }), "");
  EXPECT_NE(wrong([](auto& c) { c.messages[0].speeds.clear(); }), "");
  EXPECT_NE(wrong([](auto& c) { c.messages[1].pulses[0].metres_per_pulse = 0; }), "");
  EXPECT_NE(wrong([](auto& c) { c.messages[0].pulses = c.messages[1].pulses; }), "");
  EXPECT_NE(wrong([](auto& c) { c.messages[0].counter->bits = 1; }), "");
  EXPECT_NE(wrong([](auto& c) { c.sigma_speed = 0; }), "");
}

}  // namespace
}  // namespace hueline::drivers
