#include "drivers/transport/ip_extractor.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cstring>

#include "drivers/big_endian.hpp"
#include "drivers/transport/ip_tunnel.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint8_t kTcp = 6, kUdp = 17, kFragmentHeader = 44;
constexpr std::size_t kMaxPartials = 64;
constexpr std::size_t kMaxDatagram = 65535;
constexpr int kMostTunnels = 4;  // one inside the other
/// Fragments that are further apart are of two datagrams: the identification has 16 bits, and a scanner comes back to
/// it within a minute. Linux waits as long for IPv4; RFC 8200 allows 60 s. It is a time of the capture, not of this
/// program.
constexpr nanoseconds kLongestApart = std::chrono::seconds(30);

IpAddress mapped(const std::byte* p) {
  IpAddress address{};
  address[10] = address[11] = 0xFF;
  std::memcpy(&address[12], p, 4);
  return address;
}

}  // namespace

std::optional<IpAddress> parse_ip_address(const std::string& text) {
  std::array<std::byte, 4> v4{};
  if (::inet_pton(AF_INET, text.c_str(), v4.data()) == 1) return mapped(v4.data());
  IpAddress v6{};
  if (::inet_pton(AF_INET6, text.c_str(), v6.data()) == 1) return v6;
  return {};
}

std::string to_text(const IpAddress& address) {
  constexpr std::array<std::byte, 4> none{};
  const IpAddress any_v4 = mapped(none.data());
  const bool is_v4 = std::equal(address.begin(), address.begin() + 12, any_v4.begin());
  std::array<char, INET6_ADDRSTRLEN> text{};
  ::inet_ntop(is_v4 ? AF_INET : AF_INET6, is_v4 ? &address[12] : &address[0], text.data(), text.size());
  return text.data();
}

std::optional<UdpDatagram> IpExtractor::extract(const CaptureFrame& frame) {
  segment_.reset();
  // Frames without a time have that of the frame before.
  if (frame.time != nanoseconds{0}) now_ = frame.time;
  const LinkPayload link = link_payload(frame);
  card_ = link.card;
  tunnels_ = 0;
  return network(link, frame.length > frame.bytes.size());
}

std::optional<UdpDatagram> IpExtractor::network(const LinkPayload& link, bool is_cut) {
  switch (link.network) {
    case LinkPayload::Network::Ipv4:
      return ipv4(link.packet, is_cut);
    case LinkPayload::Network::Ipv6:
      return ipv6(link.packet, is_cut);
    case LinkPayload::Network::UnknownLink:
      ++counts_.unknown_link;
      counts_.unknown_link_type = link.link_type;
      return {};
    case LinkPayload::Network::Other:
      break;
  }
  ++counts_.not_udp;
  return {};
}

std::optional<UdpDatagram> IpExtractor::ipv4(std::span<const std::byte> packet, bool is_cut) {
  const auto lost = [&](std::uint64_t& counter) {
    ++counter;
    return std::nullopt;
  };
  std::uint64_t& broken = is_cut ? counts_.cut_off : counts_.malformed;
  if (packet.size() < 20) return lost(broken);
  const std::size_t header = 4 * (static_cast<std::size_t>(packet[0]) & 0x0F), total = be16(packet.data() + 2);
  if (static_cast<unsigned>(packet[0]) >> 4 != 4 || header < 20) return lost(counts_.malformed);
  if (header > packet.size()) return lost(broken);
  const std::uint16_t flags = be16(packet.data() + 6);
  const bool has_more = (flags & 0x2000) != 0;
  const std::size_t offset = 8 * static_cast<std::size_t>(flags & 0x1FFF);
  UdpDatagram datagram;
  datagram.source_card = card_;
  datagram.source = mapped(packet.data() + 12);
  datagram.destination = mapped(packet.data() + 16);
  if (const auto protocol = static_cast<std::uint8_t>(packet[9]); protocol != kUdp) {
    if (is_tunnel(protocol) && !has_more && offset == 0 && tunnels_++ < kMostTunnels)
      return network(tunnel_payload(protocol, packet.subspan(header)), is_cut);
    if (protocol == kTcp) {
      const bool is_fragment = has_more || offset != 0;
      // A total length of 0 comes from segmentation offload.
      const std::size_t size = is_fragment      ? 0
                               : total == 0     ? packet.size() - header
                               : total < header ? 0
                                                : total - header;
      tcp(packet.subspan(header), size, datagram);
    }
    return lost(counts_.not_udp);
  }
  // Bytes beyond UDP's own length are padding: frames shorter than 60 bytes are padded on the wire.
  if (!has_more && offset == 0) return udp(packet.subspan(header), is_cut, datagram);
  // A total length of 0 comes from segmentation offload.
  const std::size_t size = total == 0 ? packet.size() : total;
  if (size < header) return lost(counts_.malformed);
  if (size > packet.size()) return lost(broken);
  const auto body = packet.subspan(header, size - header);
  const FragmentKey key{datagram.source, datagram.destination, be16(packet.data() + 4), card_};
  if (!join(key, offset, !has_more, body)) return {};
  return udp(joined_[newest_].bytes, false, datagram);
}

/// Returns whether a fragment is a copy of one of the datagrams that became whole lately. It must not wait for others:
/// where a sender does not count its datagrams, it would become a part of the next.
bool IpExtractor::is_of_joined(const FragmentKey& key, std::size_t offset, std::span<const std::byte> piece) const {
  return std::ranges::any_of(joined_, [&](const Joined& one) {
    return one.key == key && now_ - one.latest <= kLongestApart && offset + piece.size() <= one.bytes.size() &&
           std::ranges::equal(std::span(one.bytes).subspan(offset, piece.size()), piece);
  });
}

bool IpExtractor::join(const FragmentKey& key, std::size_t offset, bool is_last, std::span<const std::byte> piece) {
  ++counts_.fragments;
  if (piece.empty() || offset + piece.size() > kMaxDatagram) {
    ++counts_.fragments_dropped;
    return false;
  }
  if (!partials_.contains(key) && is_of_joined(key, offset, piece)) {
    ++counts_.fragments_again;
    return false;
  }
  Partial& partial = partials_[key];
  const auto same = partial.pieces.find(offset);
  const bool is_again = same != partial.pieces.end() && std::ranges::equal(same->second, piece);
  // What waits is of an earlier datagram, of which a fragment was lost: it must not become a part of this one.
  const bool is_reused = (same != partial.pieces.end() && !is_again) || now_ - partial.latest > kLongestApart;
  if (!partial.pieces.empty() && is_reused) {
    counts_.fragments_dropped += partial.pieces.size();
    partial = {};
  }
  if (partial.pieces.empty()) partial.age = ++age_;
  partial.latest = now_;
  if (is_last) partial.total = offset + piece.size();
  const auto next = partial.pieces.lower_bound(offset);
  const bool overlaps =
      (next != partial.pieces.end() && next->first < offset + piece.size()) ||
      (next != partial.pieces.begin() && std::prev(next)->first + std::prev(next)->second.size() > offset);
  if (overlaps) {
    ++(is_again ? counts_.fragments_again : counts_.fragments_dropped);
  } else {
    partial.pieces.emplace_hint(next, offset, std::vector<std::byte>(piece.begin(), piece.end()));
    partial.bytes += piece.size();
  }
  const auto last = partial.pieces.rbegin();
  if (partial.total != 0 && partial.bytes == partial.total && last->first + last->second.size() == partial.total) {
    newest_ = (newest_ + 1) % joined_.size();
    Joined& joined = joined_[newest_];
    joined.key = key;
    joined.latest = now_;
    joined.bytes.clear();
    for (const auto& [at, bytes] : partial.pieces) joined.bytes.insert(joined.bytes.end(), bytes.begin(), bytes.end());
    partials_.erase(key);
    return true;
  }
  if (partials_.size() > kMaxPartials) {
    const auto oldest = std::min_element(partials_.begin(), partials_.end(),
                                         [](const auto& a, const auto& b) { return a.second.age < b.second.age; });
    counts_.fragments_dropped += oldest->second.pieces.size();
    partials_.erase(oldest);
  }
  return false;
}

void IpExtractor::finish() {
  for (const auto& [key, partial] : partials_) counts_.fragments_dropped += partial.pieces.size();
  partials_.clear();
}

std::optional<UdpDatagram> IpExtractor::ipv6(std::span<const std::byte> packet, bool is_cut) {
  std::uint64_t& broken = is_cut ? counts_.cut_off : counts_.malformed;
  if (packet.size() < 40) {
    ++broken;
    return {};
  }
  auto next = static_cast<std::uint8_t>(packet[6]);
  UdpDatagram datagram;
  datagram.source_card = card_;
  std::memcpy(datagram.source.data(), packet.data() + 8, 16);
  std::memcpy(datagram.destination.data(), packet.data() + 24, 16);
  auto body = packet.subspan(40);
  while (next == 0 || next == 43 || next == 60) {  // hop-by-hop, routing and destination options
    const std::size_t length = body.size() < 2 ? 0 : 8 * (static_cast<std::size_t>(body[1]) + 1);
    if (length == 0 || length > body.size()) {
      ++broken;
      return {};
    }
    next = static_cast<std::uint8_t>(body[0]);
    body = body.subspan(length);
  }
  if (next == kFragmentHeader) return ipv6_fragment(body, packet, is_cut, datagram);
  if (next != kUdp) {
    if (is_tunnel(next) && tunnels_++ < kMostTunnels) return network(tunnel_payload(next, body), is_cut);
    if (next == kTcp) {
      const std::size_t length = be16(packet.data() + 4), before = packet.size() - 40 - body.size();
      tcp(body, length == 0 ? body.size() : length < before ? 0 : length - before, datagram);
    }
    ++counts_.not_udp;
    return {};
  }
  return udp(body, is_cut, datagram);
}

/// `body` begins with the fragment header of `packet`.
std::optional<UdpDatagram> IpExtractor::ipv6_fragment(std::span<const std::byte> body,
                                                      std::span<const std::byte> packet, bool is_cut,
                                                      const UdpDatagram& between) {
  constexpr std::size_t kHeader = 8;
  const std::size_t length = be16(packet.data() + 4), before = packet.size() - 40 - body.size();
  // A length of 0 comes from segmentation offload.
  const std::size_t size = length == 0 ? body.size() : length < before ? 0 : length - before;
  if (size < kHeader || size > body.size()) {
    ++(is_cut ? counts_.cut_off : counts_.malformed);
    return {};
  }
  if (static_cast<std::uint8_t>(body[0]) != kUdp) {
    ++counts_.not_udp;
    return {};
  }
  const std::uint16_t field = be16(body.data() + 2);
  const FragmentKey key{between.source, between.destination, be32(body.data() + 4), card_};
  if (!join(key, field & 0xFFF8U, (field & 1U) == 0, body.subspan(kHeader, size - kHeader))) return {};
  return udp(joined_[newest_].bytes, false, between);
}

std::optional<UdpDatagram> IpExtractor::udp(std::span<const std::byte> segment, bool is_cut, UdpDatagram datagram) {
  const std::size_t length = segment.size() < 8 ? 0 : be16(segment.data() + 4);
  if (length < 8 || length > segment.size()) {
    ++(is_cut ? counts_.cut_off : counts_.malformed);
    return {};
  }
  datagram.source_port = be16(segment.data());
  datagram.destination_port = be16(segment.data() + 2);
  datagram.payload = segment.subspan(8, length - 8);
  if (const LinkPayload inner = vxlan_payload(datagram.destination_port, datagram.payload);
      !inner.packet.empty() && tunnels_++ < kMostTunnels)
    return network(inner, false);
  ++counts_.datagrams;
  return datagram;
}

/// Takes the segment of `size` bytes, of which the capture may have kept only the beginning.
void IpExtractor::tcp(std::span<const std::byte> segment, std::size_t size, const UdpDatagram& between) {
  constexpr unsigned kSyn = 0x02;
  ++counts_.tcp;
  const std::size_t header = segment.size() < 20 ? 0 : 4 * (static_cast<std::size_t>(segment[12]) >> 4);
  if (header < 20 || header > segment.size() || header > size) {
    ++counts_.tcp_broken;
    return;
  }
  TcpSegment& out = segment_.emplace();
  out.source = between.source;
  out.destination = between.destination;
  out.source_port = be16(segment.data());
  out.destination_port = be16(segment.data() + 2);
  out.sequence = be32(segment.data() + 4);
  out.is_first = (static_cast<unsigned>(segment[13]) & kSyn) != 0;
  const std::size_t whole = size - header;
  out.payload = segment.subspan(header, std::min(whole, segment.size() - header));
  out.cut_off = whole - out.payload.size();
}

}  // namespace hueline::drivers
