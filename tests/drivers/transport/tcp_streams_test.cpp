#include "drivers/transport/tcp_streams.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "drivers/transport/pcap_source.hpp"
#include "tests/support/pcap_writer.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::Bytes;
using test::PcapWriter;
using test::TemporaryFile;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kTime = 1'700'000'000'000'000'000;

Bytes bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// One side of a connection, whose segments a test sends as it likes.
struct Sender {
  std::uint32_t first = 1000;
  std::uint16_t port = 2112, peer = 50000;
  TcpSegment segment(std::span<const std::byte> stream, std::size_t at, std::size_t size) const {
    TcpSegment out;
    out.source_port = port;
    out.destination_port = peer;
    out.sequence = first + static_cast<std::uint32_t>(at);
    out.payload = stream.subspan(at, std::min(size, stream.size() - at));
    return out;
  }
};

struct Read {
  std::string text;
  std::vector<std::uint64_t> missing;  // of each interruption
  std::vector<std::int64_t> times;
};

Read read_all(TcpStreams& streams) {
  Read out;
  while (const auto piece = streams.next()) {
    if (piece->is_interrupted) out.missing.push_back(piece->missing);
    out.text.append(reinterpret_cast<const char*>(piece->bytes.data()), piece->bytes.size());
    out.times.push_back(count_ns(piece->received));
  }
  return out;
}

std::string random_text(std::mt19937& random, std::size_t size) {
  std::string out(size, ' ');
  for (char& c : out) c = static_cast<char>(random() & 0xFF);
  return out;
}

/// Segments of random sizes that overlap, come twice and come late give the stream that was sent, also where the 32-bit
/// number begins anew.
TEST(TcpStreams, GiveWhatWasSentWhateverTheOrderOfTheSegments) {
  std::mt19937 random(7);
  for (int run = 0; run < 60; ++run) {
    const std::string sent = random_text(random, 1 + random() % 20000);
    const Bytes stream = bytes_of(sent);
    Sender sender;
    sender.first = static_cast<std::uint32_t>(run % 2 == 0 ? random() : 0xFFFFF000u + random() % 0x1000);
    struct Piece {
      std::size_t at, size, order;
    };
    std::vector<Piece> pieces;
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t size = 1 + random() % 1448,
                        back = std::min<std::size_t>(at, random() % 4 == 0 ? random() % 100 : 0);
      pieces.push_back({at - back, size + back, at == 0 ? 0 : at + random() % 6000});
      if (random() % 5 == 0) pieces.push_back({at, size, at == 0 ? 1 : at + random() % 6000});
      at += size;
    }
    std::ranges::stable_sort(pieces, {}, &Piece::order);
    TcpStreams streams;
    for (const Piece& piece : pieces)
      streams.take(sender.segment(stream, piece.at, piece.size), HostTime(nanoseconds(kTime)));
    streams.finish();
    const Read read = read_all(streams);
    ASSERT_TRUE(read.text == sent) << "run " << run;
    ASSERT_TRUE(read.missing.empty()) << "run " << run;
  }
}

TEST(TcpStreams, ASegmentThatTheCaptureDoesNotHaveIsTold) {
  const std::string sent = "first second third";
  const Bytes stream = bytes_of(sent);
  const Sender sender;
  TcpStreams streams;
  streams.take(sender.segment(stream, 0, 6), HostTime(nanoseconds(1)));
  streams.take(sender.segment(stream, 13, 5), HostTime(nanoseconds(3)));
  EXPECT_EQ(read_all(streams).text, "first ");  // the second may still come
  streams.finish();
  const Read rest = read_all(streams);
  EXPECT_EQ(rest.text, "third");
  EXPECT_THAT(rest.missing, ElementsAre(7u));
  EXPECT_THAT(rest.times, ElementsAre(3));
}

TEST(TcpStreams, WhatWaitsIsBounded) {
  const Bytes stream(1 << 20);
  const Sender sender;
  TcpStreams streams;
  streams.take(sender.segment(stream, 0, 100), {});
  std::size_t given = 0, most = 0;
  for (std::size_t at = 200; at < stream.size(); at += 1000) {
    streams.take(sender.segment(stream, at, 1000), {});
    while (const auto piece = streams.next()) given += piece->bytes.size();
    most = std::max(most, at + 1000 - given);
  }
  EXPECT_LE(most, std::size_t{258} << 10);
  EXPECT_GE(given, stream.size() - 1200);
  // Segments without a byte in common, one byte each.
  TcpStreams sparse;
  std::size_t pieces = 0;
  for (std::size_t at = 0; at < 20'000; at += 2) {
    sparse.take(sender.segment(stream, at, 1), {});
    while (sparse.next()) ++pieces;
  }
  EXPECT_GE(pieces, 8'000u);
  // More connections than are followed: those that gave way have lost nothing that was there.
  TcpStreams many;
  given = 0;
  for (unsigned peer = 1; peer <= 600; ++peer) {
    Sender one;
    one.peer = static_cast<std::uint16_t>(peer);
    many.take(one.segment(stream, 0, 10), {});
    many.take(one.segment(stream, 20, 10), {});
    while (const auto piece = many.next()) given += piece->bytes.size();
  }
  many.finish();
  while (const auto piece = many.next()) given += piece->bytes.size();
  EXPECT_EQ(given, 600u * 20);
}

TEST(TcpStreams, WhatTheCaptureCutOffIsMissing) {
  const Bytes stream = bytes_of("0123456789abcdef");
  const Sender sender;
  TcpStreams streams;
  TcpSegment cut = sender.segment(stream, 0, 6);
  cut.cut_off = 4;
  streams.take(cut, {});
  streams.take(sender.segment(stream, 10, 6), {});
  const Read read = read_all(streams);
  EXPECT_EQ(read.text, "012345abcdef");
  EXPECT_THAT(read.missing, ElementsAre(4u));
}

TEST(TcpStreams, ANewConnectionBetweenTheSamePortsIsNoContinuation) {
  const Bytes old = bytes_of("old connection"), fresh = bytes_of("new connection");
  Sender sender;
  TcpStreams streams;
  streams.take(sender.segment(old, 0, 14), {});
  sender.first = 500;
  TcpSegment call = sender.segment(fresh, 0, 0);
  call.is_first = true;
  call.sequence -= 1;
  streams.take(call, {});
  streams.take(call, {});  // asked for twice
  streams.take(sender.segment(fresh, 0, 14), {});
  const Read read = read_all(streams);
  EXPECT_EQ(read.text, "old connectionnew connection");
  EXPECT_THAT(read.missing, ElementsAre(0u));
}

/// The frames of a connection between a device at port 2112 of 192.168.1.201 and a computer.
Bytes frame_of(const std::string& payload, std::uint32_t sequence, unsigned peer = 50000, unsigned flags = 0x10) {
  return test::ethernet_frame(
      test::ipv4_packet(test::tcp_segment(bytes_of(payload), sequence, 2112, peer, flags), 1, 0, false, 6));
}

struct Delivered {
  std::vector<std::string> payloads;
  std::vector<FaultKind> faults;
  std::string told;
};

Delivered read_device(const PcapWriter& capture, PcapSource::Config config = {}) {
  const TemporaryFile file("tcp_capture", capture.bytes());
  config.path = file.path();
  config.protocol = PcapSource::Protocol::Tcp;
  PcapSource source(config);
  Delivered out;
  EXPECT_TRUE(source.open().ok());
  for (;;) {
    const Result<Packet> packet = source.next({});
    if (!packet.ok()) return out;
    const auto bytes = packet->bytes.bytes();
    if (packet->kind == PacketKind::Wire) {
      out.payloads.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      continue;
    }
    const auto fault = decode_fault(1, packet->received, bytes);
    out.faults.push_back(fault->kind);
    out.told += fault->detail + "\n";
  }
}

TEST(TcpStreams, OfACaptureTheDevicesSideIsRead) {
  PcapWriter capture;
  capture.frame(kTime, test::ethernet_frame(
                           test::ipv4_packet(test::tcp_segment(bytes_of("command"), 7, 50000, 2112), 1, 0, false, 6)));
  capture.frame(kTime, frame_of("one", 100)).frame(kTime, frame_of("two", 103));
  capture.frame(kTime,
                test::ethernet_frame(test::ipv6_packet(test::tcp_segment(bytes_of("other"), 1, 80, 3000), 6), 0x86DD));
  const Delivered read = read_device(capture);
  EXPECT_THAT(read.payloads, ElementsAre("one", "two"));
  EXPECT_THAT(read.faults, ElementsAre(FaultKind::WrongDevice));
  EXPECT_THAT(read.told, HasSubstr("fd00::c9 port 80"));
  PcapSource::Config other;
  other.ports = {80};
  EXPECT_THAT(read_device(capture, other).payloads, ElementsAre("other"));
  other.ports = {81};
  const Delivered nothing = read_device(capture, other);
  EXPECT_TRUE(nothing.payloads.empty());
  EXPECT_THAT(nothing.told, HasSubstr("2112"));
}

/// Decoders begin anew at Disconnected, so that bytes from both sides of a gap never make one message.
TEST(TcpStreams, AGapAndANewConnectionInterruptTheStream) {
  PcapWriter gap;
  gap.frame(kTime, frame_of("one", 100)).frame(kTime, frame_of("three", 108));
  const Delivered read = read_device(gap);
  EXPECT_THAT(read.payloads, ElementsAre("one", "three"));
  EXPECT_THAT(read.faults, ElementsAre(FaultKind::Disconnected, FaultKind::Reconnected));
  EXPECT_THAT(read.told, HasSubstr("5 bytes that 192.168.1.201 sent by TCP are missing"));

  PcapWriter again;
  again.frame(kTime, frame_of("one", 100)).frame(kTime, frame_of("", 900, 50001, 0x12));
  again.frame(kTime, frame_of("two", 901, 50001));
  const Delivered second = read_device(again);
  EXPECT_THAT(second.payloads, ElementsAre("one", "two"));
  EXPECT_THAT(second.faults, ElementsAre(FaultKind::Disconnected, FaultKind::Reconnected));
}

TEST(TcpStreams, ARealConnectionIsReadWithoutAGap) {
  HUELINE_REQUIRE_DATA("sick/rms1000.pcapng");
  PcapSource source({data_file.string(), {}, {}, PcapSource::Protocol::Tcp});
  ASSERT_TRUE(source.open().ok());
  std::size_t bytes = 0;
  for (Result<Packet> packet = source.next({}); packet.ok(); packet = source.next({})) {
    EXPECT_EQ(packet->kind, PacketKind::Wire);
    bytes += packet->bytes.size();
  }
  EXPECT_EQ(bytes, 16u * 3374);  // 16 telegrams; the first one's length field says 3365, and 9 bytes are around it
}

}  // namespace
}  // namespace hueline::drivers
