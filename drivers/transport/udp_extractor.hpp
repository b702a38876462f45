#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "drivers/transport/capture_file.hpp"

namespace hueline::drivers {

/// IPv4 (mapped into the last four bytes, ::ffff:a.b.c.d) or IPv6.
using IpAddress = std::array<std::uint8_t, 16>;
/// Empty if the text is neither.
std::optional<IpAddress> parse_ip_address(const std::string& text);
/// As people write it: 192.168.1.201, or fd00::c9.
std::string to_text(const IpAddress& address);

struct UdpDatagram {
  IpAddress source{}, destination{};
  std::uint16_t source_port = 0, destination_port = 0;
  std::span<const std::byte> payload;  ///< valid until the next call
};

/// What became of the frames; each frame is counted once.
struct ExtractCounts {
  std::uint64_t datagrams = 0;
  std::uint64_t not_udp = 0;            ///< ARP, TCP, ...
  std::uint64_t tcp = 0;                ///< of these
  std::uint64_t unknown_link = 0;       ///< a link type that we do not read
  std::uint32_t unknown_link_type = 0;  ///< the latest of them
  std::uint64_t cut_off = 0;            ///< UDP, but the capture kept only the beginning
  std::uint64_t malformed = 0;          ///< headers that contradict the frame
  std::uint64_t fragments = 0;          ///< held or joined
  std::uint64_t fragments_dropped = 0;  ///< of datagrams that never became whole
};

/// UDP out of link-layer frames: Ethernet with VLAN tags, Linux cooked (1 and 2), BSD loopback, raw IP; IPv4 with
/// fragments joined, IPv6 with extension headers (fragmented IPv6 is counted as dropped). Checksums are not looked at:
/// captures on the sending host have them unfilled. Nor is IP's length, where UDP's own fits what was captured:
/// VeloView writes 1234 into the IP header of datagrams of any size. Thread-bound.
class UdpExtractor {
 public:
  /// Empty if the frame is no whole datagram (yet): counts() says why.
  std::optional<UdpDatagram> extract(const CaptureFrame& frame);
  /// Fragments still waiting are counted as dropped.
  void finish();
  const ExtractCounts& counts() const { return counts_; }

 private:
  /// Fragments of one IPv4 datagram, by offset. None overlaps another, so they are no more than a datagram has.
  struct Partial {
    std::map<std::size_t, std::vector<std::byte>> pieces;
    std::size_t bytes = 0;  ///< in all of them
    std::size_t total = 0;  ///< 0 until the last fragment came
    std::uint64_t age = 0;
  };
  using FragmentKey = std::tuple<std::uint32_t, std::uint32_t, std::uint16_t>;

  std::optional<UdpDatagram> ipv4(std::span<const std::byte> packet, bool is_cut);
  std::optional<UdpDatagram> ipv6(std::span<const std::byte> packet, bool is_cut);
  std::optional<UdpDatagram> udp(std::span<const std::byte> segment, bool is_cut, UdpDatagram datagram);
  bool join(const FragmentKey& key, std::size_t offset, bool is_last, std::span<const std::byte> piece);

  ExtractCounts counts_;
  std::map<FragmentKey, Partial> partials_;
  std::vector<std::byte> joined_;
  std::uint64_t age_ = 0;
};

}  // namespace hueline::drivers
