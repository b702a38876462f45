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
#include "drivers/transport/link_layer.hpp"

namespace hueline::drivers {

/// An IPv6 address, or an IPv4 address in the last four bytes (::ffff:a.b.c.d).
using IpAddress = std::array<std::uint8_t, 16>;
/// Reads an IPv4 or IPv6 address. Returns nothing if the text is neither.
std::optional<IpAddress> parse_ip_address(const std::string& text);
/// Writes an address in its usual form: 192.168.1.201 or fd00::c9.
std::string to_text(const IpAddress& address);

/// One UDP datagram of a capture.
struct UdpDatagram {
  IpAddress source{}, destination{};
  std::uint16_t source_port = 0, destination_port = 0;
  HardwareAddress source_card{};       ///< of the sender, or of the router between
  std::span<const std::byte> payload;  ///< valid until the next call of IpExtractor::extract()
};

/// One segment of a TCP connection.
struct TcpSegment {
  IpAddress source{}, destination{};
  std::uint16_t source_port = 0, destination_port = 0;
  std::uint32_t sequence = 0;          ///< number of the first byte of the payload, or of the SYN before it
  bool is_first = false;               ///< SYN: the sender begins a connection
  std::size_t cut_off = 0;             ///< bytes after the payload that the capture did not keep
  std::span<const std::byte> payload;  ///< valid until the next call of IpExtractor::extract()
};

/// What became of the frames of a capture. Each frame is counted once.
struct ExtractCounts {
  std::uint64_t datagrams = 0;
  std::uint64_t not_udp = 0;            ///< ARP, TCP, ...
  std::uint64_t tcp = 0;                ///< the frames of not_udp that are TCP
  std::uint64_t tcp_broken = 0;         ///< the frames of tcp whose segment is not whole and cannot be used
  std::uint64_t unknown_link = 0;       ///< frames of a link type that is not read
  std::uint32_t unknown_link_type = 0;  ///< the latest link type of these
  std::uint64_t cut_off = 0;            ///< UDP datagrams of which the capture kept only the beginning
  std::uint64_t malformed = 0;          ///< frames whose headers contradict their length
  std::uint64_t fragments = 0;          ///< fragments that wait for others or were joined
  std::uint64_t fragments_dropped = 0;  ///< fragments of datagrams that never became whole
  std::uint64_t fragments_again = 0;    ///< copies of fragments that had come: some captures see each frame twice
};

/// Takes UDP datagrams and TCP segments out of link-layer frames (link_layer.hpp has the kinds that are read). It reads
/// IPv4 and IPv6 with extension headers, whose fragments it joins, and both inside tunnels (ip_tunnel.hpp). Fragments
/// of a packet that is a tunnel are not joined. Fragments of TCP are not joined, because TCP avoids them. It ignores
/// checksums, because captures on the sending host do not have them filled in. It ignores the length in the IP header
/// if the length in the UDP header fits what was captured, because VeloView writes 1234 into the IP header of datagrams
/// of any size. Thread safety: none; one thread calls all functions.
class IpExtractor {
 public:
  /// Returns the datagram in `frame`. Returns nothing if the frame holds no whole datagram, or not yet; counts() says
  /// why.
  std::optional<UdpDatagram> extract(const CaptureFrame& frame);
  /// Returns the TCP segment of the frame that extract() was given last, or nothing if it holds none.
  const std::optional<TcpSegment>& segment() const { return segment_; }
  /// Counts the fragments that still wait as dropped. Call it after the last frame.
  void finish();
  const ExtractCounts& counts() const { return counts_; }

 private:
  /// The fragments of one datagram, by their offset in bytes. They never overlap, so together they are not larger
  /// than a datagram.
  struct Partial {
    std::map<std::size_t, std::vector<std::byte>> pieces;
    std::size_t bytes = 0;  ///< sum over all pieces
    std::size_t total = 0;  ///< size of the whole datagram; 0 until the last fragment has come
    nanoseconds latest{0};  ///< when its latest fragment was captured
    std::uint64_t age = 0;  ///< running number of the datagram's first fragment; the smallest is the oldest
  };
  /// Source, destination, identification, and the card, because scanners as they come from the maker have one address.
  using FragmentKey = std::tuple<IpAddress, IpAddress, std::uint32_t, HardwareAddress>;

  /// A datagram that became whole.
  struct Joined {
    FragmentKey key;
    std::vector<std::byte> bytes;
    nanoseconds latest{0};
  };

  std::optional<UdpDatagram> network(const LinkPayload& link, bool is_cut);
  std::optional<UdpDatagram> ipv4(std::span<const std::byte> packet, bool is_cut);
  std::optional<UdpDatagram> ipv6(std::span<const std::byte> packet, bool is_cut);
  std::optional<UdpDatagram> ipv6_fragment(std::span<const std::byte> body, std::span<const std::byte> packet,
                                           bool is_cut, const UdpDatagram& between);
  std::optional<UdpDatagram> udp(std::span<const std::byte> segment, bool is_cut, UdpDatagram datagram);
  void tcp(std::span<const std::byte> segment, std::size_t size, const UdpDatagram& between);
  bool join(const FragmentKey& key, std::size_t offset, bool is_last, std::span<const std::byte> piece);
  bool is_of_joined(const FragmentKey& key, std::size_t offset, std::span<const std::byte> piece) const;

  ExtractCounts counts_;
  std::optional<TcpSegment> segment_;
  std::map<FragmentKey, Partial> partials_;
  std::array<Joined, 8> joined_;  // a ring
  std::size_t newest_ = 0;        // the latest of them
  std::uint64_t age_ = 0;
  int tunnels_ = 0;         // of the latest frame, that were opened
  nanoseconds now_{0};      ///< time of the latest frame
  HardwareAddress card_{};  ///< that sent the latest frame
};

}  // namespace hueline::drivers
