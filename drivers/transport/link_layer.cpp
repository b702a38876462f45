#include "drivers/transport/link_layer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>

#include "drivers/big_endian.hpp"
#include "drivers/little_endian.hpp"
#include "drivers/transport/wifi_frame.hpp"

namespace hueline::drivers {
namespace {

using Network = LinkPayload::Network;
using LinkBytes = std::span<const std::byte>;

/// Numbers of the Tcpdump Group.
enum LinkType : std::uint32_t {
  kNull = 0,
  kEthernet = 1,
  kPpp = 9,
  kRawOfBsd = 12,
  kPppSerial = 50,
  kRaw = 101,
  kWifi = 105,
  kLoop = 108,
  kCooked1 = 113,
  kPrism = 119,
  kRadiotap = 127,
  kOldPktap = 149,  // reserved for private use; Apple took it before it had a number
  kAvs = 163,
  kPpi = 192,
  kRawIpv4 = 228,
  kRawIpv6 = 229,
  kNflog = 239,
  kPktap = 258,
  kCooked2Link = 276,
  kBroadcomTag = 281,
  kBroadcomTagBefore = 282,
  kDsaTag = 284,
  kEdsaTag = 285,
};

/// `frame` without its first bytes; empty if it has no more.
LinkBytes behind(LinkBytes frame, std::size_t bytes) { return frame.subspan(std::min(bytes, frame.size())); }

LinkPayload of_ip_version(LinkBytes packet) {
  if (packet.empty()) return {};
  const unsigned version = static_cast<unsigned>(packet[0]) >> 4;
  if (version != 4 && version != 6) return {};
  return {.network = version == 4 ? Network::Ipv4 : Network::Ipv6, .packet = packet, .card = {}, .link_type = 0};
}

/// Below the labels of MPLS stands what both sides have agreed on; IP is known by its version.
LinkPayload of_mpls(LinkBytes labels) {
  while (labels.size() >= 4) {
    const bool is_last = (static_cast<unsigned>(labels[2]) & 1U) != 0;
    labels = labels.subspan(4);
    if (is_last) return of_ip_version(labels);
  }
  return {};
}

LinkPayload by_ether_type(LinkBytes frame, std::size_t type_at) {
  if (frame.size() < type_at + 2) return {};
  return ether_type_payload(be16(frame.data() + type_at), frame.subspan(type_at + 2));
}

}  // namespace

LinkPayload ppp_payload(LinkBytes frame) {
  if (frame.size() >= 2 && frame[0] == std::byte{0xFF} && frame[1] == std::byte{3}) frame = frame.subspan(2);
  if (frame.size() < 2) return {};
  const bool is_short = (static_cast<unsigned>(frame[0]) & 1U) != 0;
  const unsigned protocol = is_short ? static_cast<unsigned>(frame[0]) : be16(frame.data());
  const LinkBytes rest = frame.subspan(is_short ? 1 : 2);
  if (protocol == 0x21 || protocol == 0x57) return of_ip_version(rest);
  return protocol == 0x0281 ? of_mpls(rest) : LinkPayload{};
}

LinkPayload ether_type_payload(std::uint16_t type, LinkBytes rest) {
  for (;;) {
    if (type == 0x0800 || type == 0x86DD)
      return {.network = type == 0x0800 ? Network::Ipv4 : Network::Ipv6, .packet = rest, .card = {}, .link_type = 0};
    if (type == 0x8864) return ppp_payload(behind(rest, 6));  // PPPoE, in a session
    if (type == 0x8847 || type == 0x8848) return of_mpls(rest);
    if (type == 0x88E5) {  // MACsec; E and C: the rest is encrypted or was changed
      if (rest.size() < 6 || (static_cast<unsigned>(rest[0]) & 0x0CU) != 0) return {};
      const std::size_t tag = (static_cast<unsigned>(rest[0]) & 0x20U) != 0 ? 14 : 6;
      if (rest.size() < tag + 2) return {};
      type = be16(rest.data() + tag);
      rest = rest.subspan(tag + 2);
      continue;
    }
    const bool is_vlan = type == 0x8100 || type == 0x88A8 || type == 0x9100;
    const bool has_snap = type < 0x0600 && rest.size() >= 8 && be32(rest.data()) == 0xAAAA0300 &&
                          rest[4] == std::byte{0} && rest[5] == std::byte{0};
    if ((!is_vlan || rest.size() < 4) && !has_snap) return {};
    type = be16(rest.data() + (is_vlan ? 2 : 6));  // behind the two bytes of the tag; in front of the packet
    rest = rest.subspan(is_vlan ? 4 : 8);
  }
}

LinkPayload ethernet_payload(LinkBytes frame) { return by_ether_type(frame, 12); }

namespace {

/// What the kernel's packet filter logs: a header of four bytes, and fields with their length and type in the order of
/// the computer that wrote the file.
LinkPayload of_nflog(LinkBytes frame, bool is_big_endian) {
  constexpr std::size_t kHeader = 4, kField = 4;
  constexpr unsigned kPacket = 9;
  const auto number = [&](std::size_t at) -> std::size_t {
    return is_big_endian ? be16(frame.data() + at) : get_little<std::uint16_t>(frame, at);
  };
  for (std::size_t at = kHeader; at + kField <= frame.size();) {
    const std::size_t length = number(at), type = number(at + 2) & 0x7FFFU;
    if (length < kField) break;
    if (type == kPacket) return of_ip_version(frame.subspan(at + kField, std::min(length, frame.size() - at) - kField));
    at += (length + 3) / 4 * 4;
  }
  return {};
}

LinkPayload of_wifi(LinkBytes frame, bool is_padded = false) {
  const WifiPayload found = wifi_payload(frame, is_padded);
  LinkPayload out = ether_type_payload(0, found.body);
  out.card = found.sender;
  return out;
}

LinkPayload of_radiotap(LinkBytes frame) {
  const RadiotapHeader header = radiotap_header(frame);
  return header.length == 0 ? LinkPayload{} : of_wifi(frame.subspan(header.length), header.is_padded);
}

/// A header that says its length at an offset of four bytes: those of Prism in the order of the computer, of AVS in
/// that of the network.
LinkPayload of_wifi_behind(LinkBytes frame, bool is_big_endian) {
  if (frame.size() < 8) return {};
  const std::size_t length = is_big_endian ? be32(frame.data() + 4) : get_little<std::uint32_t>(frame, 4);
  return length < 8 ? LinkPayload{} : of_wifi(behind(frame, length));
}

/// Takes off the headers that only say how the frame was captured. Returns the link type of what is behind them.
std::uint32_t take_capture_header(std::uint32_t link_type, LinkBytes& frame) {
  constexpr int kMostHeaders = 4;
  for (int i = 0; i < kMostHeaders; ++i) {
    // PKTAP: u32 length, u32 type of the record, u32 link type. PPI: u8 version, u8 flags, u16 length, u32 link type.
    // Both are little endian whatever the file is.
    const bool is_pktap = link_type == kPktap || link_type == kOldPktap;
    const std::size_t least = is_pktap ? 12 : 8;
    if ((!is_pktap && link_type != kPpi) || frame.size() < least) break;
    const std::size_t length = is_pktap ? get_little<std::uint32_t>(frame, 0) : get_little<std::uint16_t>(frame, 2);
    if (length < least || length > frame.size()) break;
    link_type = get_little<std::uint32_t>(frame, is_pktap ? 8 : 4);
    frame = frame.subspan(length);
  }
  return link_type;
}

LinkPayload payload_of(std::uint32_t link_type, LinkBytes frame, bool is_big_endian) {
  switch (link_type) {
    case kEthernet:
      return ethernet_payload(frame);
    case kBroadcomTag:
    case kBroadcomTagBefore:
    case kDsaTag:
      return by_ether_type(frame, 16);
    case kEdsaTag:
      return by_ether_type(frame, 20);
    case kNull:
    case kLoop:
      return of_ip_version(behind(frame, 4));  // behind the address family of BSD
    case kRawOfBsd:
    case kRaw:
    case kRawIpv4:
    case kRawIpv6:
      return of_ip_version(frame);
    case kPpp:
    case kPppSerial:
      return ppp_payload(frame);
    case kWifi:
      return of_wifi(frame);
    case kRadiotap:
      return of_radiotap(frame);
    case kPrism:
      return of_wifi_behind(frame, is_big_endian);
    case kAvs:
      return of_wifi_behind(frame, true);
    case kNflog:
      return of_nflog(frame, is_big_endian);
    case kCooked1:
      return by_ether_type(frame, 14);
    case kCooked2Link:  // the type comes first, and the header has 20 bytes
      return frame.size() < 20 ? LinkPayload{} : ether_type_payload(be16(frame.data()), frame.subspan(20));
    default:
      return {.network = Network::UnknownLink, .packet = {}, .card = {}, .link_type = 0};
  }
}

/// Ethernet has the sender's card behind the receiver's; Linux cooked 1 and 2 say how long it is.
HardwareAddress sending_card(std::uint32_t link_type, LinkBytes frame) {
  HardwareAddress out{};
  std::size_t at = 0;
  if (link_type == kEthernet || link_type == kBroadcomTag || link_type == kDsaTag || link_type == kEdsaTag) at = 6;
  if (link_type == kBroadcomTagBefore) at = 10;
  if (link_type == kCooked1 && frame.size() >= 6 && be16(frame.data() + 4) == out.size()) at = 6;
  if (link_type == kCooked2Link && frame.size() >= 12 && frame[11] == std::byte{6}) at = 12;
  if (at != 0 && frame.size() >= at + out.size()) std::memcpy(out.data(), frame.data() + at, out.size());
  return out;
}

}  // namespace

std::string to_text(const HardwareAddress& address) { return fmt::format("{:02x}", fmt::join(address, ":")); }

LinkPayload link_payload(const CaptureFrame& frame) {
  LinkBytes bytes = frame.bytes;
  const std::uint32_t link_type = take_capture_header(frame.link_type, bytes);
  LinkPayload out = payload_of(link_type, bytes, frame.is_big_endian);
  if (const HardwareAddress card = sending_card(link_type, bytes); card != HardwareAddress{}) out.card = card;
  out.link_type = link_type;
  return out;
}

}  // namespace hueline::drivers
