#include "drivers/pps/pps_packet.hpp"

#include <fmt/format.h>

namespace hueline::drivers {

namespace {

void put(std::byte* at, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) at[i] = static_cast<std::byte>(value >> (8 * i));
}
std::uint64_t get(const std::byte* at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= static_cast<std::uint64_t>(at[i]) << (8 * i);
  return value;
}

}  // namespace

const char* name(PpsEdgeKind kind) { return kind == PpsEdgeKind::Assert ? "assert" : "clear"; }

std::array<std::byte, kPpsPacketSize> encode_pps(const PpsPacket& packet) {
  std::array<std::byte, kPpsPacketSize> bytes;
  put(&bytes[0], kPpsMagic, 4);
  put(&bytes[4], static_cast<std::uint64_t>(packet.edge), 4);
  put(&bytes[8], packet.sequence, 8);
  put(&bytes[16], static_cast<std::uint64_t>(count_ns(packet.time)), 8);
  return bytes;
}

Result<PpsPacket> decode_pps(std::span<const std::byte> bytes) {
  if (bytes.size() != kPpsPacketSize)
    return Error{ErrorCode::Malformed,
                 fmt::format("PPS packet of {} bytes; {} are right", bytes.size(), kPpsPacketSize)};
  if (const auto magic = get(&bytes[0], 4); magic != kPpsMagic)
    return Error{ErrorCode::Malformed,
                 fmt::format("PPS packet begins with 0x{:08x}, not with 0x{:08x}", magic, kPpsMagic)};
  const auto edge = get(&bytes[4], 4);
  if (edge != 1 && edge != 2)
    return Error{ErrorCode::Malformed, fmt::format("PPS packet with edge {}; 1 is assert, 2 is clear", edge)};
  return PpsPacket{static_cast<PpsEdgeKind>(edge), get(&bytes[8], 8),
                   host_time_ns(static_cast<std::int64_t>(get(&bytes[16], 8)))};
}

}  // namespace hueline::drivers
