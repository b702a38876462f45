#include "drivers/transport/pcap_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "tests/support/pcap_writer.hpp"
#include "tests/support/test_data.hpp"

namespace hueline::drivers {
namespace {

using test::Bytes;
using test::ByteWriter;
using test::PcapWriter;
using test::TemporaryFile;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kTime = 1'700'000'000'123'456'789;

struct Read {
  std::vector<std::string> payloads;
  std::vector<std::int64_t> times;
  std::vector<Fault> faults;
  std::vector<Error> ends;  // up to and with EndOfData
};

Read read_all(PcapSource& source) {
  Read read;
  const Status opened = source.open();
  if (!opened) {
    read.ends.push_back(opened.error());
    return read;
  }
  while (read.ends.empty() || read.ends.back().code != ErrorCode::EndOfData) {
    Result<Packet> packet = source.next({});
    if (!packet) {
      read.ends.push_back(packet.error());
      if (read.ends.size() > 3) return read;
      continue;
    }
    const std::span<const std::byte> bytes = packet->bytes.bytes();
    if (packet->kind == PacketKind::Fault) {
      read.faults.push_back(*decode_fault(kSystemSensor, packet->received, bytes));
    } else {
      read.payloads.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      read.times.push_back(count_ns(packet->received));
    }
  }
  return read;
}

Read read_bytes(std::span<const std::byte> bytes, PcapSource::Config config = {}) {
  const TemporaryFile file("capture", bytes);
  config.path = file.path();
  PcapSource source(config);
  return read_all(source);
}

Bytes plain(const std::string& payload, unsigned port = 2368) {
  return test::ethernet_frame(test::ipv4_packet(test::udp_segment(payload, port)));
}

TEST(PcapSource, ReadsEitherByteOrderAndEitherResolution) {
  for (const bool is_big : {false, true})
    for (const bool has_ns : {false, true}) {
      PcapWriter file(1, is_big, has_ns);
      file.frame(kTime, plain("one")).frame(kTime + 1'000, plain("two"));
      const Read read = read_bytes(file.bytes());
      EXPECT_THAT(read.payloads, ElementsAre("one", "two"));
      const std::int64_t first = has_ns ? kTime : kTime / 1000 * 1000;
      EXPECT_THAT(read.times, ElementsAre(first, first + 1'000));
      EXPECT_EQ(read.ends.size(), 1u);
    }
}

TEST(PcapSource, ReadsTheLinkTypesThatCapturesOfVehiclesHave) {
  const Bytes v4 = test::ipv4_packet(test::udp_segment("v4", 2368));
  const Bytes v6 = test::ipv6_packet(test::udp_segment("v6", 2368));
  const Bytes cooked = ByteWriter(true).zeros(14).u16(0x0800).raw(v4).bytes();
  const Bytes cooked2 = ByteWriter(true).u16(0x86DD).zeros(18).raw(v6).bytes();
  const Bytes tagged2 = ByteWriter(true).u16(0x8100).zeros(18).u16(7).u16(0x0800).raw(v4).bytes();
  const Bytes loopback = ByteWriter(false).u32(2).raw(v4).bytes();
  const Bytes options = ByteWriter(true).u8(17).u8(0).zeros(6).raw(test::udp_segment("options", 2368)).bytes();
  const Bytes padded = ByteWriter(true).raw(test::ethernet_frame(v4)).zeros(14).bytes();
  const struct {
    std::uint32_t link;
    Bytes frame;
    const char* payload;
  } cases[] = {{1, test::ethernet_frame(v4), "v4"},
               {1, test::ethernet_frame(v4, 0x0800, 1), "v4"},
               {1, test::ethernet_frame(v4, 0x0800, 2), "v4"},
               {1, padded, "v4"},
               {1, test::ethernet_frame(v6, 0x86DD), "v6"},
               {1, test::ethernet_frame(test::ipv6_packet(options, 60), 0x86DD), "options"},
               {101, v4, "v4"},
               {101, v6, "v6"},
               {113, cooked, "v4"},
               {276, cooked2, "v6"},
               {276, tagged2, "v4"},
               {0, loopback, "v4"}};
  for (const auto& c : cases) {
    const Read read = read_bytes(PcapWriter(c.link).frame(kTime, c.frame).bytes());
    EXPECT_THAT(read.payloads, ElementsAre(c.payload)) << "link type " << c.link;
    EXPECT_TRUE(read.faults.empty());
  }
}

/// What stands between the addresses of Ethernet and IP, and in front of a frame, where a computer captures on its
/// switch, a connection to a provider, or a Mac.
TEST(PcapSource, ReadsWhatIsInsideOtherHeaders) {
  const Bytes v4 = test::ipv4_packet(test::udp_segment("v4", 2368));
  const Bytes v6 = test::ipv6_packet(test::udp_segment("v6", 2368));
  const Bytes ethernet = test::ethernet_frame(v4);
  const Bytes ppp4 = ByteWriter(true).u16(0x0021).raw(v4).bytes();
  const auto behind_addresses = [](const Bytes& rest) { return ByteWriter(true).zeros(12).raw(rest).bytes(); };
  const auto session = [](const Bytes& ppp) {
    return ByteWriter(true).u16(0x8864).u16(0x1100).u16(7).u16(static_cast<unsigned>(ppp.size())).raw(ppp).bytes();
  };
  const Bytes in_vlan = ByteWriter(true).u16(0x8100).u16(5).raw(session(ppp4)).bytes();
  const Bytes short_ppp6 = ByteWriter(true).u8(0x57).raw(v6).bytes();
  const Bytes labels = ByteWriter(true).u16(0x8847).u32(0x00010040).u32(0x00011140).raw(v4).bytes();
  const Bytes labels_in_ppp = ByteWriter(true).u16(0x0281).u32(0x00011140).raw(v4).bytes();
  const Bytes snap = ByteWriter(true).u16(300).u32(0xAAAA0300).u16(0).u16(0x0800).raw(v4).bytes();
  const Bytes dsa = ByteWriter(true).u32(0x40000001).u16(0x0800).raw(v4).bytes();
  const Bytes edsa = ByteWriter(true).u16(0xDADA).u16(0).u32(0x40000001).u16(0x0800).raw(v4).bytes();
  const Bytes before = ByteWriter(true).u32(0x20000001).raw(ethernet).bytes();
  const Bytes serial = ByteWriter(true).u16(0xFF03).raw(ppp4).bytes();
  const Bytes pktap = ByteWriter(false).u32(108).u32(1).u32(1).zeros(96).raw(ethernet).bytes();
  const Bytes ppi = ByteWriter(false).u8(0).u8(0).u16(8).u32(1).raw(ethernet).bytes();
  const struct {
    std::uint32_t link;
    Bytes frame;
    const char* payload;
  } cases[] = {{1, behind_addresses(session(ppp4)), "v4"},
               {1, behind_addresses(in_vlan), "v4"},
               {1, behind_addresses(session(short_ppp6)), "v6"},
               {1, behind_addresses(labels), "v4"},
               {1, behind_addresses(snap), "v4"},
               {9, ppp4, "v4"},
               {9, labels_in_ppp, "v4"},
               {50, serial, "v4"},
               {284, behind_addresses(dsa), "v4"},
               {285, behind_addresses(edsa), "v4"},
               {281, behind_addresses(dsa), "v4"},
               {282, before, "v4"},
               {258, pktap, "v4"},
               {149, pktap, "v4"},
               {192, ppi, "v4"}};
  for (const auto& c : cases) {
    const Read read = read_bytes(PcapWriter(c.link).frame(kTime, c.frame).bytes());
    EXPECT_THAT(read.payloads, ElementsAre(c.payload)) << "link type " << c.link << ", " << c.frame.size() << " bytes";
    EXPECT_TRUE(read.faults.empty());
    // Cut anywhere, it is no datagram, and nothing is read behind its end.
    for (std::size_t size = 0; size + 1 < c.frame.size(); ++size)
      EXPECT_THAT(read_bytes(PcapWriter(c.link).frame(kTime, std::span(c.frame).first(size)).bytes()).payloads,
                  testing::IsEmpty());
  }
  // A header that is longer than its frame, and one around another kind of frame, are of a link type that is not read.
  const Bytes longer = ByteWriter(false).u32(4000).u32(1).u32(1).zeros(96).raw(ethernet).bytes();
  const Bytes radio = ByteWriter(false).u8(0).u8(0).u16(8).u32(201).raw(ethernet).bytes();
  for (const auto& [link, frame, told] : {std::tuple(258u, longer, "258"), std::tuple(192u, radio, "201")}) {
    const Read read = read_bytes(PcapWriter(link).frame(kTime, frame).bytes());
    ASSERT_EQ(read.faults.size(), 2u);  // the second: no datagram was delivered
    EXPECT_THAT(read.faults[0].detail, HasSubstr(told));
  }
}

/// Expects that a frame gives one datagram with `payload`, and cut anywhere none, nor a word of what is behind its end.
void expect_inside(std::uint32_t link, const Bytes& frame, const char* payload, bool is_big = false) {
  const Read read = read_bytes(PcapWriter(link, is_big, true).frame(kTime, frame).bytes());
  EXPECT_THAT(read.payloads, ElementsAre(payload)) << "link type " << link << ", " << frame.size() << " bytes";
  EXPECT_TRUE(read.faults.empty());
  for (std::size_t size = 0; size + 1 < frame.size(); ++size)
    EXPECT_THAT(read_bytes(PcapWriter(link, is_big, true).frame(kTime, std::span(frame).first(size)).bytes()).payloads,
                testing::IsEmpty())
        << "link type " << link << ", cut to " << size << " bytes";
}

/// The protocols of IP that carry packets of another network, and VXLAN, which is carried by UDP.
TEST(PcapSource, ReadsWhatIsInsideTunnels) {
  constexpr unsigned kIpv4 = 4, kIpv6 = 41, kGre = 47;
  const Bytes v4 = test::ipv4_packet(test::udp_segment("v4", 2368));
  const Bytes v6 = test::ipv6_packet(test::udp_segment("v6", 2368));
  const Bytes inner = test::ethernet_frame(v4);
  const auto in_ipv4 = [](const Bytes& body, unsigned protocol) {
    return test::ethernet_frame(test::ipv4_packet(body, 1, 0, false, protocol));
  };
  const auto gre = [](unsigned flags, unsigned type, std::size_t options, const Bytes& rest) {
    return ByteWriter(true).u16(flags).u16(type).zeros(options).raw(rest).bytes();
  };
  expect_inside(1, in_ipv4(v4, kIpv4), "v4");
  expect_inside(1, in_ipv4(v6, kIpv6), "v6");
  expect_inside(1, test::ethernet_frame(test::ipv6_packet(v6, kIpv6), 0x86DD), "v6");
  expect_inside(1, test::ethernet_frame(test::ipv6_packet(v4, kIpv4), 0x86DD), "v4");
  expect_inside(1, in_ipv4(gre(0, 0x0800, 0, v4), kGre), "v4");
  expect_inside(1, in_ipv4(gre(0xB000, 0x86DD, 12, v6), kGre), "v6");  // checksum, key and sequence number
  expect_inside(1, in_ipv4(gre(0, 0x6558, 0, inner), kGre), "v4");
  expect_inside(1, in_ipv4(gre(0x3081, 0x880B, 12, ByteWriter(true).u16(0xFF03).u16(0x0021).raw(v4).bytes()), kGre),
                "v4");
  expect_inside(1, in_ipv4(gre(0, 0x88BE, 0, inner), kGre), "v4");           // ERSPAN type I
  expect_inside(1, in_ipv4(gre(0x1000, 0x88BE, 4 + 8, inner), kGre), "v4");  // type II
  const Bytes type3 = ByteWriter(true).zeros(11).u8(1).zeros(8).raw(inner).bytes();
  expect_inside(1, in_ipv4(gre(0x1000, 0x22EB, 4, type3), kGre), "v4");
  const Bytes vxlan = ByteWriter(true).u32(0x08000000).u32(0x00002A00).raw(inner).bytes();
  const auto datagram_of = [](const Bytes& bytes, unsigned port) {
    return test::ethernet_frame(test::ipv4_packet(
        test::udp_segment(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), port)));
  };
  expect_inside(1, datagram_of(vxlan, 4789), "v4");
  expect_inside(1, datagram_of(vxlan, 8472), "v4");
  // Of another port, or not VXLAN: the datagram itself.
  const Bytes other = ByteWriter(true).u32(0x09000000).u32(0x00002A00).raw(inner).bytes();
  for (const Bytes& frame : {datagram_of(vxlan, 4790), datagram_of(other, 4789)}) {
    const Read read = read_bytes(PcapWriter(1).frame(kTime, frame).bytes());
    ASSERT_EQ(read.payloads.size(), 1u);
    EXPECT_EQ(read.payloads[0].size(), vxlan.size());
  }
  // Tunnels in tunnels come to an end.
  Bytes nested = v4;
  for (int i = 0; i < 4; ++i) nested = test::ipv4_packet(nested, 1, 0, false, kIpv4);
  expect_inside(101, nested, "v4");
  nested = test::ipv4_packet(nested, 1, 0, false, kIpv4);
  EXPECT_THAT(read_bytes(PcapWriter(101).frame(kTime, nested).bytes()).payloads, testing::IsEmpty());
}

/// A computer records a bridge of Wi-Fi in monitor mode. Frames: IEEE 802.11.
TEST(PcapSource, ReadsWirelessNetworks) {
  const Bytes v4 = test::ipv4_packet(test::udp_segment("v4", 2368));
  const Bytes llc = ByteWriter(true).u32(0xAAAA0300).u16(0).u16(0x0800).raw(v4).bytes();
  // Frame control, duration, three addresses and sequence number.
  const auto wifi = [&](unsigned type, unsigned flags, std::size_t more) {
    return ByteWriter(true).u8(type).u8(flags).zeros(22 + more).raw(llc).bytes();
  };
  const auto radiotap = [](std::uint32_t present, const Bytes& fields, const Bytes& frame) {
    const auto length = static_cast<unsigned>(8 + fields.size());
    return ByteWriter(false).u8(0).u8(0).u16(length).u32(present).raw(fields).raw(frame).bytes();
  };
  constexpr unsigned kData = 0x08, kQuality = 0x88;
  expect_inside(105, wifi(kData, 1, 0), "v4");        // to the network
  expect_inside(105, wifi(kData, 2, 0), "v4");        // from it
  expect_inside(105, wifi(kData, 3, 6), "v4");        // between two access points, with a fourth address
  expect_inside(105, wifi(kQuality, 1, 2), "v4");     // with the class of its traffic
  expect_inside(105, wifi(kQuality, 0x81, 6), "v4");  // and HT control
  expect_inside(127, radiotap(0, {}, wifi(kData, 1, 0)), "v4");
  // A second word of fields; the time, from a multiple of eight on; then the flags, of which one says that the header
  // of 802.11 (26 bytes) has two bytes more.
  const Bytes fields = ByteWriter(false).u32(0).zeros(4).zeros(8).u8(0x20).bytes();
  expect_inside(127, radiotap(0x80000003, fields, wifi(kQuality, 1, 2 + 2)), "v4");
  expect_inside(119, ByteWriter(false).u32(0x44).u32(144).zeros(136).raw(wifi(kData, 1, 0)).bytes(), "v4");
  expect_inside(119, ByteWriter(true).u32(0x44).u32(144).zeros(136).raw(wifi(kData, 1, 0)).bytes(), "v4", true);
  expect_inside(163, ByteWriter(true).u32(0x80211001).u32(64).zeros(56).raw(wifi(kData, 1, 0)).bytes(), "v4");
  expect_inside(192, ByteWriter(false).u8(0).u8(0).u16(8).u32(105).raw(wifi(kData, 1, 0)).bytes(), "v4");
  // A beacon, data without data, encrypted data, a fragment, and several frames in one are of other protocols.
  const Bytes several = ByteWriter(true).u8(kQuality).u8(1).zeros(22).u8(0x80).u8(0).raw(llc).bytes();
  for (const Bytes& frame : {wifi(0x80, 0, 0), wifi(0x48, 1, 0), wifi(kData, 0x41, 0), wifi(kData, 0x05, 0), several}) {
    const Read read = read_bytes(PcapWriter(105).frame(kTime, frame).bytes());
    EXPECT_TRUE(read.payloads.empty());
    ASSERT_EQ(read.faults.size(), 1u);
    EXPECT_THAT(read.faults[0].detail, HasSubstr("1 frames are of other protocols"));
  }
}

/// `tcpdump -i nflog` in the order of the computer; a link type with bits above it that say how frames end; MACsec.
TEST(PcapSource, ReadsLogsOfThePacketFilterAndFramesWithCheckSequences) {
  const Bytes v4 = test::ipv4_packet(test::udp_segment("v4", 2368));
  const auto size = static_cast<unsigned>(v4.size());
  for (const bool is_big : {false, true})
    expect_inside(239, ByteWriter(is_big).zeros(4).u16(5).u16(10).zeros(4).u16(4 + size).u16(9).raw(v4).bytes(), "v4",
                  is_big);
  expect_inside(0x44000001, test::ethernet_frame(v4), "v4");
  expect_inside(1, ByteWriter(true).zeros(12).u16(0x88E5).u8(0x00).u8(0).u32(7).u16(0x0800).raw(v4).bytes(), "v4");
  expect_inside(1, ByteWriter(true).zeros(12).u16(0x88E5).u8(0x20).u8(0).u32(7).zeros(8).u16(0x0800).raw(v4).bytes(),
                "v4");
  const Bytes encrypted = ByteWriter(true).zeros(12).u16(0x88E5).u8(0x0C).u8(0).u32(7).u16(0x0800).raw(v4).bytes();
  EXPECT_THAT(read_bytes(PcapWriter(1).frame(kTime, encrypted).bytes()).payloads, testing::IsEmpty());
}

TEST(PcapSource, JoinsFragmentsInAnyOrder) {
  const std::string payload(3000, 'f');
  const Bytes segment = test::udp_segment(payload + "end", 2368);
  const std::span<const std::byte> whole(segment);
  const Bytes a = test::ethernet_frame(test::ipv4_packet(whole.first(1480), 9, 0, true));
  const Bytes b = test::ethernet_frame(test::ipv4_packet(whole.subspan(1480, 1480), 9, 1480, true));
  const Bytes c = test::ethernet_frame(test::ipv4_packet(whole.subspan(2960), 9, 2960, false));
  for (const auto& order : {std::array{&a, &b, &c}, std::array{&c, &a, &b}, std::array{&b, &c, &a}}) {
    PcapWriter file;
    for (const Bytes* frame : order) file.frame(kTime, *frame);
    const Read read = read_bytes(file.bytes());
    EXPECT_THAT(read.payloads, ElementsAre(payload + "end"));
    EXPECT_TRUE(read.faults.empty());
  }
  const Read lost = read_bytes(PcapWriter().frame(kTime, a).frame(kTime, c).frame(kTime, plain("next")).bytes());
  EXPECT_THAT(lost.payloads, ElementsAre("next"));
  ASSERT_EQ(lost.faults.size(), 1u);
  EXPECT_EQ(lost.faults[0].count, 2u);
}

TEST(PcapSource, JoinsFragmentsOfIpv6) {
  const Bytes segment = test::udp_segment(std::string(3000, 'f') + "end", 2368);
  const std::span<const std::byte> whole(segment);
  const auto fragment = [&](std::size_t offset, std::size_t size, bool has_more, std::uint8_t protocol = 17) {
    const Bytes body = ByteWriter(true)
                           .u8(protocol)
                           .u8(0)
                           .u16(static_cast<std::uint16_t>(offset | (has_more ? 1U : 0U)))
                           .u32(77)
                           .raw(whole.subspan(offset, size))
                           .bytes();
    return test::ethernet_frame(test::ipv6_packet(body, 44), 0x86DD);
  };
  const Bytes a = fragment(0, 1448, true), b = fragment(1448, 1448, true);
  const Bytes c = fragment(2896, whole.size() - 2896, false);
  for (const auto& order : {std::array{&a, &b, &c}, std::array{&c, &a, &b}}) {
    PcapWriter file;
    for (const Bytes* frame : order) file.frame(kTime, *frame);
    const Read read = read_bytes(file.bytes());
    EXPECT_THAT(read.payloads, ElementsAre(std::string(3000, 'f') + "end"));
    EXPECT_TRUE(read.faults.empty());
  }
  const Read others = read_bytes(PcapWriter().frame(kTime, fragment(0, 1448, true, 6)).frame(kTime, a).bytes());
  EXPECT_TRUE(others.payloads.empty());
  ASSERT_FALSE(others.faults.empty());
  EXPECT_EQ(others.faults[0].count, 1u);  // of UDP, and not whole
}

// The identification of a datagram comes back. A fragment that waits for one that was lost is not a part of the next.
TEST(PcapSource, NeverJoinsFragmentsOfTwoDatagrams) {
  const auto fragments = [](char fill) {
    const Bytes segment = test::udp_segment(std::string(2000, fill), 2368);
    const std::span<const std::byte> whole(segment);
    return std::pair(test::ethernet_frame(test::ipv4_packet(whole.first(1480), 9, 0, true)),
                     test::ethernet_frame(test::ipv4_packet(whole.subspan(1480), 9, 1480, false)));
  };
  const auto [a1, a2] = fragments('a');
  const auto [b1, b2] = fragments('b');
  const auto expect_b_alone = [](const Read& read) {
    EXPECT_THAT(read.payloads, ElementsAre(std::string(2000, 'b')));
    ASSERT_EQ(read.faults.size(), 1u);
    EXPECT_EQ(read.faults[0].count, 1u);
  };
  constexpr std::int64_t kMinute = 60'000'000'000;
  // Soon: the fragment at the same place has other bytes.
  expect_b_alone(read_bytes(PcapWriter().frame(kTime, a1).frame(kTime + 1, b1).frame(kTime + 2, b2).bytes()));
  // Late: no fragment stands at the same place before the datagram would be whole.
  expect_b_alone(
      read_bytes(PcapWriter().frame(kTime, a1).frame(kTime + kMinute, b2).frame(kTime + kMinute, b1).bytes()));
}

/// As a capture on all interfaces of a computer with a bridge sees each frame, or one at a mirrored port.
TEST(PcapSource, FragmentsThatComeTwiceAreNotLost) {
  const auto fragments = [](char fill, unsigned identification) {
    const Bytes segment = test::udp_segment(std::string(3000, fill), 2368);
    const std::span<const std::byte> whole(segment);
    return std::array{test::ethernet_frame(test::ipv4_packet(whole.first(1480), identification, 0, true)),
                      test::ethernet_frame(test::ipv4_packet(whole.subspan(1480, 1480), identification, 1480, true)),
                      test::ethernet_frame(test::ipv4_packet(whole.subspan(2960), identification, 2960, false))};
  };
  // Also if the sender does not count its datagrams: what is left of the first is no part of the second.
  for (const unsigned second : {10U, 9U}) {
    const auto a = fragments('a', 9), b = fragments('b', second);
    PcapWriter file;
    for (const auto* datagram : {&a, &b})
      for (const Bytes& frame : *datagram) file.frame(kTime, frame).frame(kTime, frame);
    const Read read = read_bytes(file.bytes());
    EXPECT_THAT(read.payloads, ElementsAre(std::string(3000, 'a'), std::string(3000, 'b'))) << second;
    EXPECT_TRUE(read.faults.empty()) << read.faults[0].detail;
  }
}

TEST(PcapSource, FragmentsThatOverlapAreNotKept) {
  const Bytes segment = test::udp_segment(std::string(3000, 'f'), 2368);
  const std::span<const std::byte> whole(segment);
  PcapWriter file;
  file.frame(kTime, test::ethernet_frame(test::ipv4_packet(whole.first(1480), 9, 0, true)));
  for (std::uint16_t offset = 8; offset < 1480; offset += 8)
    file.frame(kTime, test::ethernet_frame(test::ipv4_packet(whole.first(1480), 9, offset, true)));
  file.frame(kTime, test::ethernet_frame(test::ipv4_packet(whole.subspan(1480), 9, 1480, false)));
  const Read read = read_bytes(file.bytes());
  EXPECT_THAT(read.payloads, ElementsAre(std::string(3000, 'f')));
  ASSERT_EQ(read.faults.size(), 1u);
  EXPECT_EQ(read.faults[0].count, 184u);
}

TEST(PcapSource, FiltersByPortAndDeviceAndPassesOverWhatIsNotUdp) {
  PcapWriter file;
  file.frame(kTime, plain("data", 2368)).frame(kTime, plain("position", 8308)).frame(kTime, plain("other", 53));
  file.frame(kTime, test::ethernet_frame(test::ipv4_packet(Bytes(20), 1, 0, false, 6)));  // TCP
  file.frame(kTime, test::ethernet_frame(Bytes(28), 0x0806));                             // ARP
  PcapSource::Config config;
  config.ports = {2368, 8308};
  config.source_address = "192.168.1.201";
  const Read read = read_bytes(file.bytes(), config);
  EXPECT_THAT(read.payloads, ElementsAre("data", "position"));
  EXPECT_TRUE(read.faults.empty());
  config.source_address = "192.168.1.202";
  EXPECT_TRUE(read_bytes(file.bytes(), config).payloads.empty());
  config.source_address = "nonsense";
  EXPECT_EQ(read_bytes(file.bytes(), config).ends.at(0).code, ErrorCode::Invalid);
}

/// VeloView writes the length of a data packet into every IP header.
TEST(PcapSource, AWrongIpLengthIsNoReasonWhereUdpsOwnFits) {
  for (const unsigned length : {0u, 21u, 33u, 1234u, 65535u}) {
    Bytes v4 = test::ipv4_packet(test::udp_segment("position", 8308)),
          v6 = test::ipv6_packet(test::udp_segment("position", 8308));
    v4[2] = v6[4] = static_cast<std::byte>(length >> 8);
    v4[3] = v6[5] = static_cast<std::byte>(length & 0xFF);
    for (const Bytes& frame : {test::ethernet_frame(v4), test::ethernet_frame(v6, 0x86DD)}) {
      PcapWriter file;
      const Read read = read_bytes(file.frame(kTime, frame).bytes());
      EXPECT_THAT(read.payloads, ElementsAre("position")) << length;
      EXPECT_TRUE(read.faults.empty()) << length;
    }
  }
}

TEST(PcapSource, ARealCaptureOfVeloViewLosesNoPositionPacket) {
  HUELINE_REQUIRE_DATA("velodyne/vlp16_product_21.pcap");
  PcapSource source({data_file.string(), {}, {}});
  const Read read = read_all(source);
  EXPECT_EQ(read.payloads.size(), 100u);
  EXPECT_EQ(
      std::count_if(read.payloads.begin(), read.payloads.end(), [](const std::string& p) { return p.size() == 512; }),
      16);
  EXPECT_TRUE(read.faults.empty());
}

TEST(PcapSource, ACaptureWithoutTheDeviceSaysWhatItHolds) {
  PcapSource::Config config;
  config.ports = {2400};
  PcapWriter file;
  file.frame(kTime, plain("data", 2368)).frame(kTime, plain("data", 2368)).frame(kTime, plain("position", 8308));
  Read read = read_bytes(file.bytes(), config);
  ASSERT_EQ(read.faults.size(), 1u);
  EXPECT_EQ(read.faults[0].kind, FaultKind::WrongDevice);
  EXPECT_EQ(read.faults[0].count, 3u);
  EXPECT_THAT(read.faults[0].detail, HasSubstr("ports 2368 (2), 8308 (1), from 192.168.1.201 (3)"));

  PcapWriter tcp;
  tcp.frame(kTime, test::ethernet_frame(test::ipv4_packet(Bytes(20), 1, 0, false, 6)));
  read = read_bytes(tcp.bytes());
  ASSERT_EQ(read.faults.size(), 1u);
  EXPECT_THAT(read.faults[0].detail, HasSubstr("1 frames are of TCP connections"));

  PcapWriter bluetooth(201);
  bluetooth.frame(kTime, plain("data", 2368));
  read = read_bytes(bluetooth.bytes());
  ASSERT_EQ(read.faults.size(), 2u);
  EXPECT_THAT(read.faults[0].detail, HasSubstr("1 of a link type that is not read (201)"));
}

/// Two scanners of one kind send to one port. Both are delivered, because nothing says which one is meant; so it must
/// be reported.
TEST(PcapSource, ASecondDeviceIsTold) {
  const auto from = [](std::uint8_t last_number, const std::string& payload) {
    Bytes frame = plain(payload, 2368);
    frame[29] = static_cast<std::byte>(last_number);  // of the IPv4 source
    return frame;
  };
  PcapWriter file;
  for (int i = 0; i < 5; ++i) file.frame(kTime + i, from(201, "a")).frame(kTime + i, from(202, "b"));
  const Read mixed = read_bytes(file.bytes());
  EXPECT_EQ(mixed.payloads.size(), 10u);
  std::uint64_t count = 0;
  for (const Fault& fault : mixed.faults) {
    EXPECT_EQ(fault.kind, FaultKind::WrongDevice);
    EXPECT_NE(fault.detail.find("192.168.1.201 and of 192.168.1.202"), std::string::npos) << fault.detail;
    count += fault.count;
  }
  EXPECT_EQ(count, 5u);
  PcapSource::Config config;
  config.source_address = "192.168.1.202";
  const Read one = read_bytes(file.bytes(), config);
  EXPECT_EQ(one.payloads.size(), 5u);
  EXPECT_TRUE(one.faults.empty());

  // A program that recognises devices itself gets all of them; the device may be one that sends by TCP.
  PcapSource::Config all;
  all.protocol = PcapSource::Protocol::All;
  EXPECT_TRUE(read_bytes(file.bytes(), all).faults.empty());

  PcapWriter replaced;  // unplugged, and back with another address
  for (const int i : {0, 1, 2}) replaced.frame(kTime + i * 1'000'000'000ll, from(201, "a"));
  for (const int i : {6, 7, 8}) replaced.frame(kTime + i * 1'000'000'000ll, from(202, "a"));
  EXPECT_TRUE(read_bytes(replaced.bytes()).faults.empty());
  EXPECT_EQ(to_text(*parse_ip_address("192.168.1.201")), "192.168.1.201");
  EXPECT_EQ(to_text(*parse_ip_address("fd00::c9")), "fd00::c9");
}

/// Two scanners as they come from the maker, at two ports of the computer.
TEST(PcapSource, ASecondCardAtTheSameAddressIsTold) {
  const Bytes segment = test::udp_segment(std::string(1600, 'f'), 2368);
  const std::span<const std::byte> whole(segment);
  const auto of_card = [](Bytes frame, unsigned number) {
    frame[6] = std::byte{0x60};
    frame[11] = static_cast<std::byte>(number);
    return frame;
  };
  // Their fragments are not mixed either, though the identification is the same.
  PcapWriter file;
  for (const std::size_t at : {std::size_t{0}, std::size_t{1480}})
    for (const unsigned card : {1u, 2u})
      file.frame(kTime, of_card(test::ethernet_frame(test::ipv4_packet(
                                    whole.subspan(at, std::min<std::size_t>(1480, whole.size() - at)), 9, at, at == 0)),
                                card));
  const Read read = read_bytes(file.bytes());
  EXPECT_THAT(read.payloads, ElementsAre(std::string(1600, 'f'), std::string(1600, 'f')));
  ASSERT_EQ(read.faults.size(), 1u);
  EXPECT_EQ(read.faults[0].kind, FaultKind::WrongDevice);
  EXPECT_THAT(read.faults[0].detail, HasSubstr("60:00:00:00:00:01 and 60:00:00:00:00:02, send as 192.168.1.201"));

  const Bytes v4 = test::ipv4_packet(test::udp_segment("v4", 2368));
  const Bytes cooked = ByteWriter(true).zeros(4).u16(6).u8(0x60).zeros(4).u8(7).zeros(2).u16(0x0800).raw(v4).bytes();
  const Bytes cooked2 = ByteWriter(true).u16(0x0800).zeros(9).u8(6).u8(0x60).zeros(4).u8(7).zeros(2).raw(v4).bytes();
  for (const auto& [link, frame] : {std::pair(113u, cooked), std::pair(276u, cooked2)}) {
    const TemporaryFile cooked_file("cooked", PcapWriter(link).frame(kTime, frame).bytes());
    PcapSource source({.path = cooked_file.path(), .ports = {}, .source_address = {}});
    EXPECT_THAT(read_all(source).payloads, ElementsAre("v4"));
    EXPECT_EQ(to_text(source.sender_card()), "60:00:00:00:00:07");
  }
}

TEST(PcapSource, FramesCutOffByTheCaptureAreCountedNotDelivered) {
  PcapWriter file;
  file.frame(kTime, plain("shortened"), 45).frame(kTime, plain("whole"));
  const Read read = read_bytes(file.bytes());
  EXPECT_THAT(read.payloads, ElementsAre("whole"));
  ASSERT_EQ(read.faults.size(), 1u);
  EXPECT_EQ(read.faults[0].count, 1u);
  EXPECT_THAT(read.faults[0].detail, HasSubstr("1 cut off"));
}

TEST(PcapSource, ATruncatedFileGivesAllThatIsWholeThenTheOffset) {
  PcapWriter file;
  file.frame(kTime, plain("one"));
  const std::size_t second = file.bytes().size();
  file.frame(kTime, plain("two"));
  const std::span<const std::byte> whole(file.bytes());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Read read = read_bytes(whole.first(size));
    EXPECT_EQ(read.payloads.size(), size < second ? 0u : 1u) << size;
    const bool is_clean = size == 24 || size == second;
    EXPECT_EQ(read.ends.at(0).code, is_clean ? ErrorCode::EndOfData : ErrorCode::Truncated) << size;
    if (size > second) {
      EXPECT_THAT(read.ends[0].message, HasSubstr("byte " + std::to_string(second)));
    }
  }
}

TEST(PcapSource, AFileThatIsNoCaptureSaysWhatItIs) {
  const auto why = [](const std::string& content) {
    const Read read = read_bytes(std::as_bytes(std::span(content)));
    return read.ends.empty() ? std::string() : read.ends.front().message;
  };
  using namespace std::string_literals;
  EXPECT_THAT(why(""), HasSubstr("the file is empty"));
  EXPECT_THAT(why("\x1f\x8b\x08\0 and so on"s), HasSubstr("unpack it with gunzip"));
  EXPECT_THAT(why("\x28\xb5\x2f\xfd and so on"), HasSubstr("unpack it with zstd -d"));
  EXPECT_THAT(why("version https://git-lfs.github.com/spec/v1\n"), HasSubstr("git lfs pull"));
  EXPECT_THAT(why("livox_tech\0\0\0\0\0\0\2\0\0\0\x67\xA7\x0E\xAC"s), HasSubstr("a recording of Livox Viewer"));
  EXPECT_THAT(why("\x34\0\0\0\x14\0\0\0OSF$ and so on to 24 bytes"s), HasSubstr("a recording of Ouster's SDK"));
  EXPECT_THAT(why("some text"), HasSubstr("neither pcap nor pcapng"));
}

TEST(PcapSource, ABrokenLengthIsMalformedAndNothingElseIsLost) {
  PcapWriter file;
  file.frame(kTime, plain("one"));
  Bytes bytes = file.bytes();
  const Bytes broken = ByteWriter(false).u32(0).u32(0).u32(0x7FFFFFFF).u32(0x7FFFFFFF).bytes();
  bytes.insert(bytes.end(), broken.begin(), broken.end());
  const Read read = read_bytes(bytes);
  EXPECT_THAT(read.payloads, ElementsAre("one"));
  ASSERT_EQ(read.ends.size(), 2u);
  EXPECT_EQ(read.ends[0].code, ErrorCode::Malformed);
  EXPECT_EQ(read.ends[1].code, ErrorCode::EndOfData);
  EXPECT_EQ(read_bytes(ByteWriter(false).text("not a capture at all").bytes()).ends.at(0).code, ErrorCode::Unsupported);
  PcapSource absent({"/nonexistent/drive.pcap", {}, {}});
  const Status status = absent.open();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::Io);
  EXPECT_THAT(status.error().message, HasSubstr("/nonexistent/drive.pcap"));
}

Bytes block(bool is_big, std::uint32_t type, const Bytes& body) {
  ByteWriter out(is_big);
  const std::size_t padding = (4 - body.size() % 4) % 4;
  const std::size_t length = body.size() + padding + 12;
  return out.u32(type).u32(length).raw(body).zeros(padding).u32(length).bytes();
}

TEST(PcapSource, ReadsPcapngWithSectionsInterfacesAndTheirClocks) {
  ByteWriter file(false);
  for (const bool is_big : {false, true}) {
    const auto make = [&] { return ByteWriter(is_big); };
    const auto enhanced = [&](unsigned interface, std::uint64_t ticks, const Bytes& frame) {
      return block(is_big, 6,
                   make()
                       .u32(interface)
                       .u32(ticks >> 32)
                       .u32(ticks & 0xFFFFFFFF)
                       .u32(frame.size())
                       .u32(frame.size())
                       .raw(frame)
                       .bytes());
    };
    file.raw(block(is_big, 0x0A0D0D0A, make().u32(0x1A2B3C4D).u16(1).u16(0).u64(~0ull).bytes()));
    file.raw(block(is_big, 1, make().u16(1).u16(0).u32(0).bytes()));  // microseconds
    // Nanoseconds, counted from 1'000'000'000 s; raw IP.
    file.raw(block(is_big, 1,
                   make()
                       .u16(101)
                       .u16(0)
                       .u32(0)
                       .u16(9)
                       .u16(1)
                       .u8(9)
                       .zeros(3)
                       .u16(14)
                       .u16(8)
                       .u64(1'000'000'000)
                       .u16(0)
                       .u16(0)
                       .bytes()));
    file.raw(block(is_big, 1, make().u16(1).u16(0).u32(0).u16(9).u16(1).u8(0x8A).zeros(3).bytes()));  // 2^-10 s
    file.raw(block(is_big, 5, make().zeros(12).bytes()));                                             // statistics
    file.raw(enhanced(0, static_cast<std::uint64_t>(kTime) / 1000, plain("us")));
    file.raw(enhanced(1, static_cast<std::uint64_t>(kTime) - 1'000'000'000'000'000'000ull,
                      test::ipv4_packet(test::udp_segment("ns", 1))));
    file.raw(enhanced(2, 1024ull * 5 + 512, plain("binary")));
    const Bytes simple = plain("simple");
    file.raw(block(is_big, 3, make().u32(simple.size()).raw(simple).bytes()));
  }
  const Read read = read_bytes(file.bytes());
  EXPECT_THAT(read.payloads, ElementsAre("us", "ns", "binary", "simple", "us", "ns", "binary", "simple"));
  const std::int64_t us = kTime / 1000 * 1000, binary = 5'500'000'000;
  EXPECT_THAT(read.times, ElementsAre(us, kTime, binary, binary, us, kTime, binary, binary));

  const std::span<const std::byte> whole(file.bytes());
  for (std::size_t size = 0; size < whole.size(); size += 3) {
    const Read cut = read_bytes(whole.first(size));
    EXPECT_LE(cut.payloads.size(), 8u);
    EXPECT_TRUE(cut.ends.at(0).code == ErrorCode::Truncated || cut.ends[0].code == ErrorCode::EndOfData) << size;
  }
}

TEST(PcapSource, ASectionOfInterfacesWithoutEndIsRefused) {
  ByteWriter file(false);
  file.raw(block(false, 0x0A0D0D0A, ByteWriter(false).u32(0x1A2B3C4D).u16(1).u16(0).u64(~0ull).bytes()));
  for (int i = 0; i < 4097; ++i) file.raw(block(false, 1, ByteWriter(false).u16(1).u16(0).u32(0).bytes()));
  const Read read = read_bytes(file.bytes());
  EXPECT_EQ(read.ends.at(0).code, ErrorCode::Exhausted);
  EXPECT_THAT(read.ends[0].message, HasSubstr("more than 4096 interfaces"));
}

TEST(PcapSource, RealCapturesGiveTheirDatagrams) {
  const std::map<std::string, std::map<std::size_t, std::size_t>> sizes{{"hdl32e.pcap", {{1206, 500}}},
                                                                        {"vlp16_gps.pcap", {{1206, 293}, {512, 57}}},
                                                                        {"vlp16_scans.pcap", {{1206, 603}}}};
  for (const auto& [name, expected] : sizes) {
    HUELINE_REQUIRE_DATA("velodyne/" + name);
    PcapSource source({data_file.string(), {}, {}});
    const Read read = read_all(source);
    std::map<std::size_t, std::size_t> found;
    for (const std::string& payload : read.payloads) ++found[payload.size()];
    EXPECT_EQ(found, expected) << name;
    EXPECT_TRUE(read.faults.empty());
    EXPECT_TRUE(std::is_sorted(read.times.begin(), read.times.end())) << name;
  }
}

TEST(PcapSource, ARealPcapngGivesItsDatagrams) {
  HUELINE_REQUIRE_DATA("sick/rms1000.pcapng");
  PcapSource source({data_file.string(), {}, {}});
  const Read read = read_all(source);
  ASSERT_EQ(read.ends.size(), 1u);
  EXPECT_EQ(read.ends[0].code, ErrorCode::EndOfData) << read.ends[0].message;
  const ExtractCounts& c = source.counts();
  EXPECT_GT(c.datagrams + c.not_udp, 0u);
  EXPECT_EQ(c.malformed + c.unknown_link, 0u);
}

}  // namespace
}  // namespace hueline::drivers
