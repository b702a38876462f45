#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/transport/capture_file.hpp"

namespace hueline::drivers {

/// The address of a network card; zeros where the capture has none.
using HardwareAddress = std::array<std::uint8_t, 6>;
/// Writes an address in its usual form: 60:76:88:00:01:02.
std::string to_text(const HardwareAddress& address);

/// What a frame of a capture carries.
struct LinkPayload {
  enum class Network : std::uint8_t { Ipv4, Ipv6, Other, UnknownLink };
  Network network = Network::Other;
  std::span<const std::byte> packet;  ///< from the header of IP on; empty for Other and UnknownLink
  HardwareAddress card{};             ///< of the sender, or of the router between
  std::uint32_t link_type = 0;        ///< of the frame itself, where another header stood before it
};

/// Finds the packet of IP in a frame. It reads Ethernet, also with what stands between its addresses and IP: VLAN tags,
/// the labels of MPLS, the headers of PPPoE and of LLC with SNAP, and the tags of a switch of Marvell (DSA) or
/// Broadcom, which a computer with such a switch captures, and MACsec that does not encrypt; Linux cooked (1 and 2),
/// BSD loopback, PPP, raw IP, and what the kernel's packet filter logs (NFLOG); wireless networks in monitor mode,
/// without encryption, also behind radiotap and the headers of Prism and AVS; and any of these behind the header of
/// macOS (PKTAP, as tcpdump writes it there without -i) or of PPI. Sources: the link types of the Tcpdump Group
/// (tcpdump.org/linktypes); RFC 2516 (PPPoE), 3032 (MPLS), 1042 (SNAP), 1661 and 1662 (PPP); IEEE 802.1Q and 802.1AE;
/// net/dsa/tag_dsa.c of Linux for the places of its tags.
LinkPayload link_payload(const CaptureFrame& frame);

/// The same for parts of frames, as tunnels carry them: a frame of Ethernet; a frame that begins with the protocol of
/// PPP, whose zero byte may be left out; and what follows an Ethernet type and the header in which the type stands.
LinkPayload ethernet_payload(std::span<const std::byte> frame);
LinkPayload ppp_payload(std::span<const std::byte> frame);
LinkPayload ether_type_payload(std::uint16_t type, std::span<const std::byte> rest);

}  // namespace hueline::drivers
