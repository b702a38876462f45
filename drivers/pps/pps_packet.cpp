#include "drivers/pps/pps_packet.hpp"

#include <fmt/format.h>

#include "drivers/little_endian.hpp"

namespace hueline::drivers {

const char* name(PpsEdgeKind kind) { return kind == PpsEdgeKind::Assert ? "assert" : "clear"; }

std::array<std::byte, kPpsPacketSize> encode_pps(const PpsPacket& packet) {
  std::array<std::byte, kPpsPacketSize> bytes;
  put_little(bytes, 0, kPpsMagic);
  put_little(bytes, 4, static_cast<std::uint32_t>(packet.edge));
  put_little(bytes, 8, packet.sequence);
  put_little(bytes, 16, static_cast<std::uint64_t>(count_ns(packet.time)));
  return bytes;
}

Result<PpsPacket> decode_pps(std::span<const std::byte> bytes) {
  if (bytes.size() != kPpsPacketSize)
    return Error{ErrorCode::Malformed,
                 fmt::format("PPS packet of {} bytes; {} are right", bytes.size(), kPpsPacketSize)};
  if (const auto magic = get_little<std::uint32_t>(bytes, 0); magic != kPpsMagic)
    return Error{ErrorCode::Malformed,
                 fmt::format("PPS packet begins with 0x{:08x}, not with 0x{:08x}", magic, kPpsMagic)};
  const auto edge = get_little<std::uint32_t>(bytes, 4);
  if (edge != 1 && edge != 2)
    return Error{ErrorCode::Malformed, fmt::format("PPS packet with edge {}; 1 is assert, 2 is clear", edge)};
  return PpsPacket{static_cast<PpsEdgeKind>(edge), get_little<std::uint64_t>(bytes, 8),
                   host_time_ns(static_cast<std::int64_t>(get_little<std::uint64_t>(bytes, 16)))};
}

}  // namespace hueline::drivers
