#include "drivers/transport/ip_tunnel.hpp"

#include "drivers/big_endian.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint8_t kIpv4 = 4, kIpv6 = 41, kGre = 47;

LinkPayload of_gre(std::span<const std::byte> body) {
  constexpr unsigned kChecksum = 0x8000, kRouting = 0x4000, kKey = 0x2000, kSequence = 0x1000, kAcknowledge = 0x0080;
  constexpr std::uint16_t kPpp = 0x880B, kEthernet = 0x6558, kErspan2 = 0x88BE, kErspan3 = 0x22EB;
  if (body.size() < 4) return {};
  const unsigned flags = be16(body.data()), version = flags & 7U;
  const std::uint16_t type = be16(body.data() + 2);
  if (version > 1 || (flags & kRouting) != 0) return {};
  std::size_t header = 4;
  for (const unsigned bit : {kChecksum, kKey, kSequence}) header += (flags & bit) != 0 ? 4 : 0;
  if (version == 1 && (flags & kAcknowledge) != 0) header += 4;
  // Type I of ERSPAN has neither a sequence number nor a header of its own. Type III says whether a part follows its
  // header.
  if (type == kErspan2 && (flags & kSequence) != 0) header += 8;
  if (type == kErspan3 && body.size() >= header + 12)
    header += (static_cast<unsigned>(body[header + 11]) & 1U) != 0 ? 20 : 12;
  if (body.size() < header) return {};
  const auto rest = body.subspan(header);
  if (type == kEthernet || type == kErspan2 || type == kErspan3) return ethernet_payload(rest);
  return type == kPpp ? ppp_payload(rest) : ether_type_payload(type, rest);
}

}  // namespace

bool is_tunnel(std::uint8_t protocol) { return protocol == kIpv4 || protocol == kIpv6 || protocol == kGre; }

LinkPayload tunnel_payload(std::uint8_t protocol, std::span<const std::byte> body) {
  if (protocol == kGre) return of_gre(body);
  return ether_type_payload(protocol == kIpv4 ? 0x0800 : 0x86DD, body);
}

LinkPayload vxlan_payload(std::uint16_t port, std::span<const std::byte> datagram) {
  constexpr std::uint16_t kPort = 4789, kOldPortOfLinux = 8472;
  constexpr std::size_t kHeader = 8;
  const bool is_vxlan = (port == kPort || port == kOldPortOfLinux) && datagram.size() > kHeader &&
                        be32(datagram.data()) == 0x08000000 && datagram[7] == std::byte{0};
  return is_vxlan ? ethernet_payload(datagram.subspan(kHeader)) : LinkPayload{};
}

}  // namespace hueline::drivers
