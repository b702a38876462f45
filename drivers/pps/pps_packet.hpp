#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"
#include "core/time.hpp"

/// The layout of a PPS packet, the same for an edge from the kernel and from a socket. 24 bytes, little endian:
///
///   offset  size  field
///        0     4  magic 0x31535050, the characters "PPS1"
///        4     4  edge: 1 assert, 2 clear (RFC 2783)
///        8     8  sequence, number of edges of this kind that the source has seen; a gap means lost edges
///       16     8  time of the edge, HostTime, signed ns (CLOCK_MONOTONIC_RAW of the computer that reads it)
namespace hueline::drivers {

constexpr std::uint32_t kPpsMagic = 0x31535050;
constexpr std::size_t kPpsPacketSize = 24;

/// The names of RFC 2783. The wiring decides which edge is the second: a USB or RS-232 level converter inverts.
enum class PpsEdgeKind : std::uint8_t { Assert = 1, Clear = 2 };
const char* name(PpsEdgeKind kind);

/// The fields of a PPS packet.
struct PpsPacket {
  PpsEdgeKind edge = PpsEdgeKind::Assert;
  std::uint64_t sequence = 0;
  HostTime time{};  ///< the edge at the input, as the interrupt handler stamped it
};

/// Encodes a PPS packet.
std::array<std::byte, kPpsPacketSize> encode_pps(const PpsPacket& packet);
/// Decodes a PPS packet. Error: Malformed (wrong size, magic or edge).
Result<PpsPacket> decode_pps(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
