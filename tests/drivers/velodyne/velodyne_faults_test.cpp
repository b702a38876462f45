// What a VelodyneDecoder reports about packets that are lost, late, broken or of another device.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/angle.hpp"
#include "drivers/velodyne/velodyne_listener.hpp"
#include "tests/drivers/velodyne/velodyne_packets.hpp"

namespace hueline::drivers {
namespace {

using test::decode;
using test::Decoded;
using test::turning;
using test::velodyne_data;
using Blocks = test::VelodyneBlocksOfPacket;

/// Returns what the end of the stream gives.
std::vector<Fault> at_the_end(VelodyneDecoder& decoder) {
  std::vector<Measurement> out;
  decoder.flush(out);
  return test::only<Fault>(out);
}

TEST(VelodyneFaults, ALostPacketIsCountedAndLeavesItsNeighboursAlone) {
  // The same packet is decoded with and without the packets around it.
  VelodyneDecoder alone({}), gap({});
  const auto first = velodyne_data(turning(1000, 40), 10'000, 0x37, 0x22);
  const auto fourth = velodyne_data(turning(1000 + 3 * 480, 40), 10'000 + 3 * 1327, 0x37, 0x22);
  const Decoded expected = decode(alone, fourth, 4'000'000);
  EXPECT_TRUE(decode(gap, first).faults.empty());
  const Decoded found = decode(gap, fourth, 4'000'000);
  EXPECT_TRUE(found.faults.empty()) << "they may have been overtaken";
  const auto told = at_the_end(gap);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].kind, FaultKind::Lost);
  EXPECT_EQ(told[0].count, 2u);
  EXPECT_TRUE(at_the_end(gap).empty()) << "once";
  ASSERT_EQ(found.batches.at(0).returns.size(), expected.batches.at(0).returns.size());
  for (std::size_t i = 0; i < 384; ++i)
    EXPECT_EQ(found.batches[0].returns[i].azimuth, expected.batches[0].returns[i].azimuth);
}

/// The blocks of such a mode are arranged in a way that no manual describes.
TEST(VelodyneFaults, AReturnModeThatIsNotReadIsNamed) {
  const auto odd = test::packet_of(velodyne_data(turning(0, 40), 1000, 0x3B, 0x22));
  VelodyneDecoder decoder({});
  const auto faults = decode(decoder, velodyne_data(turning(0, 40), 1000, 0x3B, 0x22)).faults;
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].detail.find("return mode 0x3B is not supported"), std::string::npos) << faults[0].detail;
  const auto listener = listen_for_velodyne("none.pcap");
  EXPECT_FALSE(listener->listen(odd, "192.168.1.201"));
  EXPECT_NE(listener->unknown_models().find("a Velodyne VLP-16 in return mode 0x3B (dual with confidence)"),
            std::string::npos)
      << listener->unknown_models();
  // Another scanner may have the address. A damaged packet before good ones of the same is none of it.
  EXPECT_TRUE(listener->listen(test::packet_of(velodyne_data(turning(0, 40), 1000, 0x39, 0x24)), "192.168.1.201"));
  EXPECT_NE(listener->unknown_models(), "");
  EXPECT_TRUE(listener->listen(test::packet_of(velodyne_data(turning(0, 40), 1000, 0x39, 0x22)), "192.168.1.201"));
  EXPECT_EQ(listener->unknown_models(), "");
}

TEST(VelodyneFaults, GapsAreSeenThroughTheHourAndAcrossLongOutages) {
  VelodyneDecoder decoder({});
  const auto at = [&](std::uint32_t stamp_us, double received_s) {
    return decode(decoder, velodyne_data(turning(0, 40), stamp_us, 0x37, 0x22), std::llround(received_s * 1e9)).faults;
  };
  EXPECT_TRUE(at(3'599'999'500, 0).empty());
  EXPECT_TRUE(at(827, 0.0013).empty());        // the hour turned
  EXPECT_TRUE(at(2'000'827, 7202.0).empty());  // two hours and two seconds
  const auto lost = at_the_end(decoder);
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_EQ(lost[0].kind, FaultKind::Lost);
  EXPECT_NEAR(static_cast<double>(lost[0].count), 7202.0 / 0.001327104, 3);
  const auto stepped = at(1'800'000'000, 7202.1);  // half an hour in 0.1 s: the clock was set
  ASSERT_EQ(stepped.size(), 1u);
  EXPECT_EQ(stepped[0].kind, FaultKind::ClockStep);
  EXPECT_TRUE(at(1'800'001'327, 7202.1013).empty());
  const auto late = at(1'799'998'673, 7202.1014);
  ASSERT_EQ(late.size(), 1u);
  EXPECT_EQ(late[0].kind, FaultKind::Late);
  EXPECT_TRUE(at(1'800'002'654, 7202.1027).empty());  // measured from the newest, not from the late one
}

TEST(VelodyneFaults, PacketsThatAComputerHeldBackAreAllUsedAndTheClockIsNotBlamed) {
  VelodyneDecoder decoder({});
  std::size_t batches = 0;
  std::vector<Fault> faults;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const std::uint32_t stamp_us = i * 1327u;
    // A computer stands still from 1.0 s to 1.4 s.
    const std::int64_t arrival_us = stamp_us > 1'000'000 && stamp_us < 1'400'000 ? 1'400'000 + i : stamp_us;
    const auto found =
        decode(decoder, velodyne_data(turning(i * 480 % 36000, 40), stamp_us, 0x37, 0x22), arrival_us * 1000);
    batches += found.batches.size();
    faults.insert(faults.end(), found.faults.begin(), found.faults.end());
  }
  EXPECT_EQ(batches, 2000u);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].kind, FaultKind::Silent);
  EXPECT_TRUE(at_the_end(decoder).empty());
}

/// A scanner whose GNSS receiver names the new hour late counts on beyond the old one (ros-drivers/velodyne#218), and
/// one without a receiver may count to the end of its 32 bits.
TEST(VelodyneFaults, ACounterBeyondTheHourLosesNothing) {
  VelodyneDecoder on_time({}), late({});
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const std::uint32_t since_us = i * 1327u;
    const std::int64_t received_ns = std::int64_t{since_us} * 1000 + 2'000'000;
    const std::uint32_t told_us = 3'599'990'000u + since_us;
    const auto blocks = turning(i * 480 % 36000, 40);
    const Decoded right = decode(on_time, velodyne_data(blocks, told_us % 3'600'000'000u, 0x37, 0x22), received_ns);
    // From the 600th packet on it knows the hour.
    const Decoded beyond =
        decode(late, velodyne_data(blocks, i < 600 ? told_us : told_us % 3'600'000'000u, 0x37, 0x22), received_ns);
    ASSERT_TRUE(beyond.faults.empty()) << i << ": " << beyond.faults[0].detail;
    ASSERT_TRUE(right.faults.empty());
    ASSERT_EQ(beyond.batches.size(), 1u);
    ASSERT_EQ(beyond.batches[0].time, right.batches.at(0).time) << i;
    ASSERT_EQ(beyond.batches[0].returns.size(), right.batches[0].returns.size());
  }
  EXPECT_TRUE(at_the_end(late).empty());
}

TEST(VelodyneFaults, PositionPacketsBeyondTheHourKeepTheirTime) {
  test::Bytes packet = test::velodyne_position(3'600'300'000u, 2, "");
  const Result<VelodynePosition> position = decode_position(packet);
  ASSERT_TRUE(position.ok());
  EXPECT_EQ(position->hour_us, 300'000u);
}

/// Packets that overtake each other are late, not lost. A packet that is cut short has come.
TEST(VelodyneFaults, WhatComesLateOrBrokenIsNotLost) {
  VelodyneDecoder decoder({});
  std::map<FaultKind, std::uint64_t> told;
  std::int64_t received_ns = 0;
  const auto at = [&](std::uint32_t number, std::size_t bytes = 1206) {
    test::Bytes packet = velodyne_data(
        turning(0, 40),
        3'599'990'000u + number * 1327u < 3'600'000'000u ? 3'599'990'000u + number * 1327u : number * 1327u - 10'000u,
        0x37, 0x22);
    packet.resize(bytes);
    for (const Fault& fault : decode(decoder, packet, received_ns += 1'327'000).faults) told[fault.kind] += fault.count;
  };
  for (const std::uint32_t number : {0, 1, 3, 2, 7, 5, 4, 6, 8}) at(number);  // the hour turns among them
  EXPECT_EQ(told[FaultKind::Late], 4u);
  at(9, 700);
  at(10, 3);
  for (const std::uint32_t number : {11, 12, 15, 14}) at(number);
  for (std::uint32_t number = 16; number < 116; ++number) at(number);
  EXPECT_EQ(told[FaultKind::Lost], 1u) << "13";
  EXPECT_EQ(told[FaultKind::Late], 5u);
  at(116);
  at(119);
  for (const Fault& fault : at_the_end(decoder)) told[fault.kind] += fault.count;
  EXPECT_EQ(told[FaultKind::Lost], 3u);
}

TEST(VelodyneFaults, BrokenBlocksAreLeftOutAndCounted) {
  Blocks blocks = turning(1000, 40);
  blocks[4].flag = 0xDDFF;
  blocks[7].azimuth = 36000;
  VelodyneDecoder decoder({});
  const Decoded d = decode(decoder, velodyne_data(blocks, 0, 0x37, 0x22));
  ASSERT_EQ(d.faults.size(), 1u);
  EXPECT_EQ(d.faults[0].kind, FaultKind::Malformed);
  ASSERT_EQ(d.batches.size(), 1u);
  EXPECT_EQ(d.batches[0].returns.size(), 320u);
  // The block before a broken one continues at the packet's rate.
  for (const LaserReturn& r : d.batches[0].returns)
    EXPECT_NEAR(r.azimuth, (10 + 0.4 * r.time_offset_ns / 110592.0) * kRadPerDeg, 1e-6);
  EXPECT_EQ(decoder.counts().malformed_bytes, 200u);
  EXPECT_EQ(decoder.counts().decoded_bytes, 1006u);
}

TEST(VelodyneFaults, BlocksBehindAnAzimuthJumpHaveNoTime) {
  Blocks blocks = turning(1000, 40);
  for (std::size_t b = 9; b < 12; ++b) blocks[b].azimuth += 9000;
  VelodyneDecoder decoder({});
  const Decoded d = decode(decoder, velodyne_data(blocks, 0, 0x37, 0x22));
  EXPECT_TRUE(d.faults.empty()) << "the next packet may date them";
  EXPECT_EQ(d.batches.at(0).returns.size(), 9u * 32);
  const std::vector<Fault> faults = at_the_end(decoder);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].kind, FaultKind::NoTime);
  EXPECT_EQ(faults[0].count, 3u);
}

TEST(VelodyneFaults, ThePacketBehindDatesTheBlocksBehindAnAzimuthJump) {
  Blocks blocks = turning(1000, 40);
  for (std::size_t b = 9; b < 12; ++b) blocks[b].azimuth += 9000;
  VelodyneDecoder decoder({});
  EXPECT_EQ(decode(decoder, velodyne_data(blocks, 0, 0x37, 0x22), 0).batches.size(), 1u);
  const Decoded d = decode(decoder, velodyne_data(turning(10480, 40), 100'000, 0x37, 0x22), 100'000'000);
  ASSERT_EQ(d.batches.size(), 2u);
  EXPECT_EQ(d.batches[0].returns.size(), 3u * 32);
  // Three blocks before the stamp of the packet behind.
  EXPECT_EQ(test::counter(d.batches[0].time), std::chrono::nanoseconds(100'000'000 - 3 * 110'592));
  EXPECT_NEAR(d.batches[0].returns[0].azimuth, 103.6 * kRadPerDeg, 1e-6);
  EXPECT_EQ(d.batches[0].returns[0].time_offset_ns, 0);
  EXPECT_EQ(decoder.counts().decoded_bytes, 2u * 1206);
}

TEST(VelodyneFaults, WrongBytesAreCountedAndSaid) {
  VelodyneDecoder decoder({});
  std::vector<Fault> faults;
  std::uint64_t bytes = 0;
  const auto feed = [&](const test::Bytes& packet, std::int64_t received_ns) {
    bytes += packet.size();
    const Decoded d = decode(decoder, packet, received_ns);
    EXPECT_TRUE(d.batches.empty());
    faults.insert(faults.end(), d.faults.begin(), d.faults.end());
  };
  for (int i = 0; i < 100; ++i) feed(test::Bytes(1205), i);
  feed({}, 100);
  feed(velodyne_data(turning(0, 40), 0, 0x36, 0x22), 101);
  feed(test::Bytes(3), 1'000'000'001);
  std::uint64_t said = 0;
  for (const Fault& fault : faults) {
    EXPECT_EQ(fault.kind, FaultKind::Malformed);
    said += fault.count;
  }
  EXPECT_EQ(said, 103u);
  EXPECT_EQ(decoder.counts().malformed_messages, 103u);
  EXPECT_EQ(decoder.counts().malformed_bytes, bytes);
}

/// The stream of a VLP-16 that is set to a field of view. Its blocks go from `begin_deg` to `end_deg`, twelve in a
/// packet, whether or not the silence between revolutions is inside a packet. The packet's stamp is that of its first
/// block.
class FieldOfView {
 public:
  FieldOfView(double begin_deg, double end_deg) : begin_(begin_deg), end_(end_deg) {}

  /// Returns the next packet and advances the time of its arrival.
  test::Bytes next() {
    Blocks blocks = turning(0, 0);
    double stamp_us = 0;
    for (std::size_t b = 0; b < 12; ++b) {
      while (!is_inside()) turn();
      if (b == 0) stamp_us = time_us_;
      blocks[b].azimuth = static_cast<unsigned>(std::lround(azimuth_ * 100)) % 36000;
      turn();
    }
    received_ns = std::llround(time_us_ * 1e3);
    return velodyne_data(blocks, static_cast<std::uint32_t>(std::llround(stamp_us)), 0x37, 0x22);
  }
  void set(double begin_deg, double end_deg) { begin_ = begin_deg, end_ = end_deg; }
  std::int64_t received_ns = 0;

 private:
  bool is_inside() const {
    return begin_ < end_ ? azimuth_ >= begin_ && azimuth_ < end_ : azimuth_ >= begin_ || azimuth_ < end_;
  }
  void turn() {
    azimuth_ = std::fmod(azimuth_ + 0.2 + 0.001 * std::sin(time_us_ * 1e-5), 360);  // the motor is not even
    time_us_ += 110.592;
  }
  double begin_, end_, azimuth_ = 350, time_us_ = 0;
};

TEST(VelodyneFaults, APartOfTheCircleThatIsNotSentIsNotLost) {
  VelodyneDecoder decoder({});
  FieldOfView scanner(320, 40);
  std::map<FaultKind, std::uint64_t> told;
  const auto feed = [&](int packets) {
    for (int i = 0; i < packets; ++i) {
      const test::Bytes bytes = scanner.next();
      for (const Fault& fault : decode(decoder, bytes, scanner.received_ns).faults) told[fault.kind] += fault.count;
    }
  };
  feed(2000);  // sixty revolutions; the silence begins anywhere in a packet, also between two
  EXPECT_EQ(told[FaultKind::Lost], 0u);
  EXPECT_EQ(told[FaultKind::NoTime], 0u);

  for (int i = 0; i < 10; ++i) scanner.next();  // within a field of view, or beside the silence
  feed(100);
  for (int i = 0; i < 400; ++i) scanner.next();  // many revolutions
  feed(100);
  EXPECT_NEAR(static_cast<double>(told[FaultKind::Lost]), 410, 30);

  told.clear();
  scanner.set(300, 60);  // set anew while it runs
  feed(1000);
  scanner.set(0, 360);
  feed(1000);
  EXPECT_LE(told[FaultKind::Lost], 250u) << "one revolution's silence at most";
}

TEST(VelodyneFaults, NoBlockOfAFieldOfViewIsMissing) {
  VelodyneDecoder decoder({});
  FieldOfView scanner(320, 40);
  std::size_t blocks = 0;
  for (int i = 0; i < 340; ++i) {
    const test::Bytes bytes = scanner.next();
    const Decoded d = decode(decoder, bytes, scanner.received_ns);
    EXPECT_TRUE(d.faults.empty());
    for (const LaserBatch& batch : d.batches) blocks += batch.returns.size() / 32;
  }
  for (const Fault& fault : at_the_end(decoder)) blocks += fault.count;
  EXPECT_EQ(blocks, 340u * 12);
}

TEST(VelodyneFaults, AnotherModelIsNamed) {
  VelodyneDecoder decoder({});
  std::vector<Fault> faults;
  for (std::uint32_t i = 0; i < 30; ++i) {
    const Decoded d = decode(decoder, velodyne_data(turning(16 * i, 16), 553 * i, 0x37, 0x21), 553'000 * i);
    EXPECT_TRUE(d.batches.empty()) << i;
    faults.insert(faults.end(), d.faults.begin(), d.faults.end());
  }
  ASSERT_EQ(faults.size(), 30u);
  EXPECT_EQ(faults[0].kind, FaultKind::WrongDevice);
  EXPECT_NE(faults[0].detail.find("timed as a HDL-32E's"), std::string::npos) << faults[0].detail;
  EXPECT_EQ(decoder.counts().ignored_bytes, 30 * 1206u);
}

/// As when one computer plays the recordings of two scanners to one port.
TEST(VelodyneFaults, AScannerHasOneFactoryByte) {
  VelodyneDecoder::Config config;
  config.model = VelodyneModel::Hdl32e;
  VelodyneDecoder decoder(config);
  std::size_t others = 0, batches = 0;
  std::uint32_t other_us = 1'000'000;
  for (unsigned i = 0; i < 60; ++i) {
    batches +=
        decode(decoder, velodyne_data(turning(100 * i, 20), 1000 + 553 * i, 0x37, 0x21), 553'000 * i).batches.size();
    if (i % 3 != 2) continue;
    const Decoded found =
        decode(decoder, velodyne_data(turning(100 * i, 20), other_us += 1327, 0x37, 0x22), 553'000 * i + 1000);
    EXPECT_TRUE(found.batches.empty());
    for (const Fault& fault : found.faults) others += fault.kind == FaultKind::WrongDevice ? 1 : 0;
  }
  EXPECT_EQ(batches, 60u);
  EXPECT_EQ(others, 20u);
}

/// An HDL-64E has a byte of its status where others have their product: now and then that of any model.
TEST(VelodyneFaults, AnHdl64eIsNoOtherModelWhateverItsLastByteSays) {
  VelodyneDecoder::Config config;
  config.model = VelodyneModel::Vlp32c;
  VelodyneDecoder decoder(config);
  Blocks blocks = turning(0, 12);
  for (std::size_t b = 1; b < 12; b += 2) blocks[b].flag = 0xDDFF;
  const Decoded found = decode(decoder, velodyne_data(blocks, 1000, 0x37, 0x28));
  EXPECT_TRUE(found.batches.empty());
  ASSERT_EQ(found.faults.size(), 1u);
  EXPECT_EQ(found.faults[0].kind, FaultKind::WrongDevice);
  EXPECT_NE(found.faults[0].detail.find("an HDL-64E, which is not supported"), std::string::npos)
      << found.faults[0].detail;
}

TEST(VelodyneFaults, AProductWithoutNameIsWrittenOnce) {
  const auto detail_of = [](std::uint8_t product) {
    VelodyneDecoder decoder({});
    std::string detail;
    for (std::uint32_t i = 0; i < 30; ++i) {
      const Decoded d = decode(decoder, velodyne_data(turning(16 * i, 16), 553 * i, 0x37, product), 553'000 * i);
      for (const Fault& fault : d.faults) detail = fault.detail;
    }
    return detail;
  };
  EXPECT_EQ(detail_of(0xF1),
            "data packet of product 0xF1, timed as a HDL-32E's; the rig names a VLP-16 (0x22): the key model");
  EXPECT_EQ(
      detail_of(0x28),
      "data packet of product 0x28 (VLP-32C), timed as a HDL-32E's; the rig names a VLP-16 (0x22): the key model");
}

/// VLP-16s with old firmware send the HDL-32E's byte. None of their packets is lost, not even the first ones.
TEST(VelodyneFaults, TheTimingOutranksTheFactoryByte) {
  for (const bool is_dual : {false, true}) {
    VelodyneDecoder decoder({});
    std::vector<Measurement> out;
    for (std::uint32_t i = 0; i < 50; ++i) {
      const std::uint32_t stamp = (is_dual ? 6636 : 13271) * i / 10;
      decoder.decode(test::packet_of(velodyne_data(turning(40 * i, 40, is_dual), stamp, is_dual ? 0x39 : 0x37, 0x21),
                                     std::int64_t{1000} * stamp),
                     out);
    }
    decoder.flush(out);
    const auto batches = test::only<LaserBatch>(out);
    ASSERT_EQ(batches.size(), 50u) << is_dual;
    for (std::size_t i = 1; i < batches.size(); ++i)
      EXPECT_GT(test::counter(batches[i].time), test::counter(batches[i - 1].time));
    EXPECT_TRUE(test::only<Fault>(out).empty());
    EXPECT_EQ(decoder.counts().decoded_bytes, 50 * 1206u);
  }
}

/// If the rig names the model of the byte, the fault says so.
TEST(VelodyneFaults, ARigThatNamesTheByteOfAnotherTimingIsTold) {
  VelodyneDecoder::Config config;
  config.model = VelodyneModel::Hdl32e;
  VelodyneDecoder decoder(config);
  std::size_t batches = 0;
  std::string said;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const Decoded d =
        decode(decoder, velodyne_data(turning(16 * i, 16), 1327 * i, 0x37, 0x21), std::int64_t{1'327'000} * i);
    batches += d.batches.size();
    for (const Fault& fault : d.faults) said += fault.detail;
  }
  EXPECT_LE(batches, 21u);
  EXPECT_NE(said.find("timed as a VLP-16's"), std::string::npos) << said;
}

/// A Puck Hi-Res has the timing of a VLP-16, but other elevations.
TEST(VelodyneFaults, AModelOfTheSameTimingIsNotTakenForAnother) {
  VelodyneDecoder decoder({});
  for (std::uint32_t i = 0; i < 30; ++i) {
    const Decoded d =
        decode(decoder, velodyne_data(turning(40 * i, 40), 1327 * i, 0x37, 0x24), std::int64_t{1'327'000} * i);
    EXPECT_TRUE(d.batches.empty());
    ASSERT_EQ(d.faults.size(), 1u);
    EXPECT_NE(d.faults[0].detail.find("Puck Hi-Res"), std::string::npos);
  }
}

}  // namespace
}  // namespace hueline::drivers
