#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/transport/link_layer.hpp"

namespace hueline::drivers {

/// Returns whether a packet of IP may carry another network's packet: IP in IP, IPv6 in IPv4 (6in4), GRE.
bool is_tunnel(std::uint8_t protocol);
/// Finds the packet of IP inside `body`, which follows a header of IP that names `protocol`. GRE may carry IP,
/// Ethernet, PPP (PPTP), or Ethernet of a mirrored port (ERSPAN). Sources: RFC 2003, 2473, 2784, 2890, 2637, 4213;
/// draft-foschiano-erspan.
LinkPayload tunnel_payload(std::uint8_t protocol, std::span<const std::byte> body);

/// Finds the packet of IP inside a datagram to `port` that is one of VXLAN (RFC 7348); network Other if it is none.
LinkPayload vxlan_payload(std::uint16_t port, std::span<const std::byte> datagram);

}  // namespace hueline::drivers
