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
/// Broadcom, which a computer with such a switch captures; Linux cooked (1 and 2), BSD loopback, PPP, and raw IP; and
/// any of these behind the header of macOS (PKTAP, as tcpdump writes it there without -i) or of PPI. Sources: the link
/// types of the Tcpdump Group (tcpdump.org/linktypes); RFC 2516 (PPPoE), 3032 (MPLS), 1042 (SNAP), 1661 and 1662 (PPP);
/// IEEE 802.1Q; net/dsa/tag_dsa.c of Linux for the places of its tags.
LinkPayload link_payload(const CaptureFrame& frame);

}  // namespace hueline::drivers
