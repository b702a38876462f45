#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <string>
#include <vector>

#include "core/calendar.hpp"
#include "drivers/pps/ptp_decoder.hpp"

namespace hueline::drivers {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// 2026-03-01T12:00:00 UTC is 37 s more in TAI.
constexpr seconds kTai(1'772'366'437);

struct Heard {
  std::vector<PpsEdge> edges;
  std::vector<TimeLabel> labels;
  std::vector<std::string> faults;
};
Heard hear(PtpDecoder& decoder, const PtpPacket& reading, nanoseconds arrival = nanoseconds(0)) {
  std::vector<Measurement> out;
  Packet packet;
  packet.sensor = 4;
  packet.received = reading.host + arrival;
  packet.bytes = Buffer::copy_of(encode_ptp(reading));
  decoder.decode(packet, out);
  Heard heard;
  for (const Measurement& m : out) {
    if (const auto* edge = std::get_if<PpsEdge>(&m)) heard.edges.push_back(*edge);
    if (const auto* label = std::get_if<TimeLabel>(&m)) heard.labels.push_back(*label);
    if (const auto* fault = std::get_if<Fault>(&m))
      heard.faults.push_back(std::string(name(fault->kind)) + ": " + fault->detail);
  }
  EXPECT_LE(heard.edges.size() + heard.faults.size(), 1u);
  return heard;
}
PtpPacket reading(std::uint64_t sequence, nanoseconds clock) {
  return {nanoseconds(80), sequence, clock, host_time_ns(7'000'000'000)};
}

TEST(PtpDecoder, ASecondIsAnEdgeAndItsName) {
  PtpDecoder tai(PtpScale::Tai);
  const Heard heard = hear(tai, reading(1, kTai + nanoseconds(250'000)));
  ASSERT_EQ(heard.edges.size(), 1u);
  EXPECT_EQ(heard.edges[0].edge, host_time_ns(7'000'000'000 - 250'000));
  EXPECT_EQ(heard.edges[0].sensor, 4);
  ASSERT_EQ(heard.labels.size(), 1u);
  EXPECT_EQ(heard.labels[0].second, *from_utc({2026, 3, 1, 12, 0, 0, 0}));
  EXPECT_TRUE(heard.labels[0].is_valid);
  PtpDecoder utc(PtpScale::Utc);
  const Heard of_utc = hear(utc, reading(1, kTai - seconds(37)));
  ASSERT_EQ(of_utc.labels.size(), 1u);
  EXPECT_EQ(of_utc.labels[0].second, *from_utc({2026, 3, 1, 12, 0, 0, 0}));
}

TEST(PtpDecoder, WhatCannotBeTrustedIsToldAndNotUsed) {
  PtpDecoder decoder(PtpScale::Tai);
  const auto faults = [&](const PtpPacket& packet, nanoseconds arrival = nanoseconds(0)) {
    const Heard heard = hear(decoder, packet, arrival);
    EXPECT_TRUE(heard.edges.empty() && heard.labels.empty());
    return heard.faults;
  };
  EXPECT_THAT(faults(reading(1, seconds(37))), ElementsAre(HasSubstr("NoTime: the PTP clock shows 37 s since 1970")));
  EXPECT_THAT(faults(reading(2, seconds(38))), IsEmpty()) << "told once";
  EXPECT_THAT(faults(reading(3, -seconds(5))), IsEmpty());
  EXPECT_EQ(hear(decoder, reading(4, kTai)).edges.size(), 1u);
  EXPECT_THAT(faults(reading(4, kTai)), ElementsAre(HasSubstr("Spurious: reading 4 of the PTP clock came twice")));
  EXPECT_THAT(faults(reading(5, kTai + milliseconds(35))),
              ElementsAre(HasSubstr("Lost: the PTP clock was read 35 ms")));
  PtpPacket slow = reading(6, kTai);
  slow.half_window = std::chrono::microseconds(70);
  EXPECT_THAT(faults(slow), ElementsAre(HasSubstr("uncertain by 70 us")));
  EXPECT_THAT(faults(reading(7, kTai), seconds(2)), ElementsAre(HasSubstr("off its arrival")));
  const auto& counts = decoder.counts();
  EXPECT_EQ(counts.decoded_bytes, kPtpPacketSize);
  EXPECT_EQ(counts.ignored_bytes, 7 * kPtpPacketSize);
  std::vector<Measurement> out;
  for (std::size_t size = 0; size < kPtpPacketSize; ++size) {
    Packet packet;
    packet.bytes = Buffer::copy_of(std::span<const std::byte>(encode_ptp(reading(9, kTai))).first(size));
    decoder.decode(packet, out);
  }
  EXPECT_EQ(out.size(), kPtpPacketSize) << "a fault each";
  EXPECT_EQ(decoder.counts().malformed_messages, kPtpPacketSize);
  // Whatever numbers 64 bits can hold.
  constexpr auto kLeast = std::numeric_limits<std::int64_t>::min(), kMost = std::numeric_limits<std::int64_t>::max();
  std::uint64_t number = 100;
  for (const std::int64_t clock : {kLeast, kLeast + 1, kMost, count_ns(host_time_ns(kTai.count() * 1'000'000'000))})
    for (const std::int64_t host : {kLeast, kMost}) {
      Packet packet;
      packet.received = host_time_ns(7'000'000'000);
      packet.bytes = Buffer::copy_of(encode_ptp({nanoseconds(0), ++number, nanoseconds(clock), host_time_ns(host)}));
      out.clear();
      decoder.decode(packet, out);
      for (const Measurement& m : out) EXPECT_TRUE(std::holds_alternative<Fault>(m)) << clock << " " << host;
    }
}

}  // namespace
}  // namespace hueline::drivers
