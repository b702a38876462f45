// Captures of CAN buses: on the interface of a bus, and on all interfaces (Linux cooked), in either byte order.
#include "drivers/transport/can_capture.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/drivers/can/can_frames.hpp"
#include "tests/support/pcap_writer.hpp"

namespace hueline::drivers {
namespace {

using test::Bytes;
using test::ByteWriter;
using test::PcapWriter;
using test::TemporaryFile;

/// A frame as the kernel has it, with the id in the order of `out`.
void put_frame(ByteWriter& out, std::uint32_t id, const std::vector<unsigned>& data, unsigned fd_flags = 0) {
  out.u32(id).u8(static_cast<unsigned>(data.size())).u8(fd_flags).u16(0);
  for (const unsigned byte : data) out.u8(byte);
}
Bytes on_bus(std::uint32_t id, const std::vector<unsigned>& data, unsigned fd_flags = 0) {
  ByteWriter out(true);
  put_frame(out, id, data, fd_flags);
  return out.bytes();
}
/// What `tcpdump -i any` writes. The head is always big endian, the id as the computer has it.
Bytes cooked(unsigned packet_type, unsigned protocol, std::uint32_t id, const std::vector<unsigned>& data,
             bool is_big_endian) {
  ByteWriter head(true), frame(is_big_endian);
  head.u16(packet_type).u16(280).u16(0).zeros(8).u16(protocol);
  put_frame(frame, id, data);
  return head.raw(frame.bytes()).bytes();
}
Bytes cooked_2(unsigned interface, std::uint32_t id, const std::vector<unsigned>& data) {
  ByteWriter head(true), frame(false);
  head.u16(0x0C).u16(0).u32(interface).u16(280).u8(0).u8(0).zeros(8);
  put_frame(frame, id, data);
  return head.raw(frame.bytes()).bytes();
}

std::string text(const CanFrame& frame) {
  std::string out = name(frame) + (frame.is_fd ? " FD" : "") + (frame.is_remote ? " remote" : "") +
                    (frame.is_local ? " local" : "") + ":";
  for (const unsigned byte : frame.bytes()) out += fmt::format(" {:02X}", byte);
  return out;
}
/// All frames of a capture, one a line, and what could not be read.
std::string read(const Bytes& bytes) {
  const TemporaryFile file("bus.pcap", bytes);
  auto capture = CaptureFile::open(file.path());
  if (!capture.ok()) return capture.error().message;
  CanCapture log(std::move(*capture), "bus");
  std::string out;
  for (int i = 0; i < 100; ++i) {
    const auto entry = log.next();
    if (entry.ok() && !*entry) break;
    if (!entry.ok())
      out += entry.error().message.substr(0, 24) + "\n";
    else
      out += fmt::format("{} {}{}\n", to_seconds((*entry)->time),
                         (*entry)->interface.empty() ? "" : (*entry)->interface + " ", text((*entry)->frame));
  }
  return out;
}

TEST(CanCapture, ReadsTheFramesOfABus) {
  PcapWriter file(227);
  file.frame(1'500'000'000, on_bus(0x321, {0x11, 0x22}))
      .frame(2'000'000'000, on_bus(0x98FEBF0B, {1, 2, 3, 4, 5, 6, 7, 8}))
      .frame(3'000'000'000, on_bus(0x40000321, {}))
      .frame(4'000'000'000, on_bus(0x20000004, {0, 4, 0, 0, 0, 0, 0, 0}))
      .frame(5'000'000'000, on_bus(0x10, {9}, 4))
      .frame(6'000'000'000, on_bus(0x11, std::vector<unsigned>(12, 0xAB)));
  EXPECT_EQ(read(file.bytes()),
            "1.5 321: 11 22\n"
            "2 18FEBF0B: 01 02 03 04 05 06 07 08\n"
            "3 321 remote:\n"
            "4 error 0004: 00 04 00 00 00 00 00 00\n"
            "5 010 FD: 09\n"
            "6 011 FD: AB AB AB AB AB AB AB AB AB AB AB AB\n");
}

TEST(CanCapture, ReadsTheFramesOfBusesAmongThoseOfNetworks) {
  for (const bool is_big_endian : {false, true}) {
    PcapWriter file(113, is_big_endian);
    file.frame(1'000'000'000, cooked(0, 0x0C, 0x321, {0x11}, is_big_endian))
        .frame(2'000'000'000, cooked(0, 0x0800, 0x45000014, {}, is_big_endian))
        .frame(3'000'000'000, cooked(4, 0x0D, 0x98FEBF0B, {0x22}, is_big_endian));
    EXPECT_EQ(read(file.bytes()), "1 321: 11\n3 18FEBF0B FD local: 22\n") << is_big_endian;
  }
  PcapWriter two(276);
  two.frame(1'000'000'000, cooked_2(3, 0x321, {0x11})).frame(2'000'000'000, cooked_2(4, 0x321, {0x22}));
  EXPECT_EQ(read(two.bytes()), "1 3 321: 11\n2 4 321: 22\n");
}

/// As `dumpcap -i can0 -i can1` writes it.
TEST(CanCapture, TheInterfacesOfAPcapngAreToldApart) {
  ByteWriter file(false);
  const auto block = [&](std::uint32_t type, const Bytes& body) {
    const std::size_t padded = (body.size() + 3) / 4 * 4;
    file.u32(type).u32(12 + padded).raw(body).zeros(padded - body.size()).u32(12 + padded);
  };
  block(0x0A0D0D0A, ByteWriter(false).u32(0x1A2B3C4D).u16(1).u16(0).u32(0xFFFFFFFF).u32(0xFFFFFFFF).bytes());
  block(1, ByteWriter(false).u16(227).u16(0).u32(0).u16(2).u16(4).u8('c').u8('a').u8('n').u8('0').u32(0).bytes());
  block(1, ByteWriter(false).u16(227).u16(0).u32(0).bytes());
  for (const unsigned interface : {0U, 1U}) {
    const Bytes frame = on_bus(0x321, {0x11 + interface});
    block(
        6,
        ByteWriter(false).u32(interface).u32(0).u32(1'000'000).u32(frame.size()).u32(frame.size()).raw(frame).bytes());
  }
  EXPECT_EQ(read(file.bytes()), "1 can0 321: 11\n1 1 321: 12\n");

  const TemporaryFile saved("buses.pcapng", file.bytes());
  std::vector<Fault> faults;
  EXPECT_EQ(test::read_can_log(saved.path(), faults).size(), 2U);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].kind, FaultKind::WrongDevice) << faults[0].detail;
  CanLogSource one({.path = saved.path(), .interface = "can0"});
  ASSERT_TRUE(one.open().ok());
  const auto packet = one.next({});
  ASSERT_TRUE(packet.ok());
  EXPECT_EQ(packet->received, HostTime(nanoseconds(1'000'000'000)));
  CanPacket parsed;
  ASSERT_TRUE(decode_can_packet(packet->bytes.bytes(), parsed).ok());
  EXPECT_EQ(text(parsed.frames.front()), "321: 11");
  EXPECT_EQ(one.next({}).error().code, ErrorCode::EndOfData);
}

TEST(CanCapture, WhatIsBrokenIsTold) {
  PcapWriter file(227);
  const Bytes whole = on_bus(0x321, {1, 2, 3});
  file.frame(1'000'000'000, whole, 7).frame(2'000'000'000, whole, 10).frame(3'000'000'000, whole);
  Bytes xl = on_bus(0x321, {1});
  xl[4] = std::byte{0x80};
  file.frame(4'000'000'000, xl).frame(5'000'000'000, whole);
  Bytes bytes = file.bytes();
  bytes.resize(bytes.size() - 1);
  EXPECT_EQ(read(bytes),
            "bus: a frame of a CAN bu\n"
            "bus: a frame of a CAN bu\n"
            "3 321: 01 02 03\n"
            "bus: a frame of CAN XL, \n" +
                TemporaryFile("bus.pcap", {}).path().substr(0, 24) + "\n");

  const TemporaryFile saved("cut.pcap", bytes);
  std::vector<Fault> faults;
  EXPECT_EQ(test::read_can_log(saved.path(), faults).size(), 1U);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].count, 4U) << faults[0].detail;
}

TEST(CanCapture, IsKnownByItsFirstFrame) {
  const TemporaryFile bus("bus.pcap", PcapWriter(227).frame(0, on_bus(1, {})).bytes());
  const TemporaryFile network("network.pcap",
                              PcapWriter(113).frame(0, cooked(0, 0x0800, 0x45000014, {}, false)).bytes());
  const TemporaryFile empty("empty.pcap", PcapWriter(227).bytes());
  EXPECT_TRUE(is_can_capture(bus.path()));
  EXPECT_FALSE(is_can_capture(network.path()));
  EXPECT_FALSE(is_can_capture(empty.path()));
  EXPECT_FALSE(is_can_capture("/nonexistent"));
}

}  // namespace
}  // namespace hueline::drivers
