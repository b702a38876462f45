#include "drivers/pps/pps_decoder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace hueline::drivers {
namespace {

Packet packet_of(std::span<const std::byte> bytes) {
  return {.sensor = 7, .kind = PacketKind::Wire, .received = host_time_ns(5), .bytes = Buffer::copy_of(bytes)};
}
Packet edge(PpsEdgeKind kind, std::uint64_t sequence, std::int64_t ns = 1000) {
  return packet_of(encode_pps({kind, sequence, host_time_ns(ns)}));
}
std::vector<Measurement> decode(PpsDecoder& decoder, const Packet& packet) {
  std::vector<Measurement> out;
  decoder.decode(packet, out);
  return out;
}

TEST(PpsPacket, LayoutIsAsWritten) {
  const std::array<unsigned char, kPpsPacketSize> written{'P',  'P',  'S',  '1',  2,    0,    0,    0,
                                                          0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01,
                                                          0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
  const PpsPacket value{PpsEdgeKind::Clear, 0x0102030405060708, host_time_ns(-2)};
  EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(written)), encode_pps(value)));
  const auto decoded = decode_pps(std::as_bytes(std::span(written)));
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(decoded->edge, value.edge);
  EXPECT_EQ(decoded->sequence, value.sequence);
  EXPECT_EQ(decoded->time, value.time);
}

TEST(PpsDecoder, OnlyTheConfiguredEdgeIsASecond) {
  PpsDecoder decoder({.edge = PpsEdgeKind::Clear});
  EXPECT_TRUE(decode(decoder, edge(PpsEdgeKind::Assert, 1)).empty());
  const auto out = decode(decoder, edge(PpsEdgeKind::Clear, 9, 123));
  ASSERT_EQ(out.size(), 1U);
  const auto& made = std::get<PpsEdge>(out[0]);
  EXPECT_EQ(made.sensor, 7);
  EXPECT_EQ(made.edge, host_time_ns(123));
  EXPECT_EQ(made.sequence, 9U);
  EXPECT_EQ(decoder.counts().decoded_bytes, kPpsPacketSize);
  EXPECT_EQ(decoder.counts().ignored_bytes, kPpsPacketSize);
  EXPECT_THAT(decoder.counts().messages, testing::ElementsAre(testing::Pair("assert", 1), testing::Pair("clear", 1)));
}

TEST(PpsDecoder, GapIsLostWithItsCount) {
  PpsDecoder decoder({});
  EXPECT_EQ(decode(decoder, edge(PpsEdgeKind::Assert, 10)).size(), 1U);
  const auto out = decode(decoder, edge(PpsEdgeKind::Assert, 14));
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(std::get<Fault>(out[0]).kind, FaultKind::Lost);
  EXPECT_EQ(std::get<Fault>(out[0]).count, 3U);
  EXPECT_EQ(std::get<PpsEdge>(out[1]).sequence, 14U);
}

TEST(PpsDecoder, ResetForgetsTheCount) {
  PpsDecoder decoder({});
  EXPECT_EQ(decode(decoder, edge(PpsEdgeKind::Assert, 10)).size(), 1U);
  decoder.reset();
  EXPECT_EQ(decode(decoder, edge(PpsEdgeKind::Assert, 3)).size(), 1U);
}

TEST(PpsDecoder, RepeatedEdgeIsDroppedAndAFallenCountIsSaid) {
  PpsDecoder decoder({});
  EXPECT_EQ(decode(decoder, edge(PpsEdgeKind::Assert, 10)).size(), 1U);
  auto out = decode(decoder, edge(PpsEdgeKind::Assert, 10));
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(std::get<Fault>(out[0]).kind, FaultKind::Spurious);
  out = decode(decoder, edge(PpsEdgeKind::Assert, 1));
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(std::get<Fault>(out[0]).kind, FaultKind::Spurious);
  EXPECT_EQ(std::get<PpsEdge>(out[1]).sequence, 1U);
}

TEST(PpsDecoder, BrokenBytesAreMalformed) {
  auto bytes = encode_pps({PpsEdgeKind::Assert, 1, host_time_ns(1)});
  PpsDecoder decoder({});
  const auto refuse = [&](std::span<const std::byte> broken) {
    const auto out = decode(decoder, packet_of(broken));
    ASSERT_EQ(out.size(), 1U);
    EXPECT_EQ(std::get<Fault>(out[0]).kind, FaultKind::Malformed);
  };
  refuse(std::span(bytes).first(23));
  refuse({});
  bytes[0] = std::byte{'Q'};
  refuse(bytes);
  bytes[0] = std::byte{'P'};
  bytes[4] = std::byte{3};
  refuse(bytes);
  EXPECT_EQ(decoder.counts().malformed_messages, 4U);
  EXPECT_EQ(decoder.counts().malformed_bytes, 23U + 24U + 24U);
}

}  // namespace
}  // namespace hueline::drivers
