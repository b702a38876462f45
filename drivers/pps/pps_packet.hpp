#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"
#include "core/time.hpp"

/// The wire form of a PPS edge: what a PPS packet holds, whether the edge came from the kernel or over a socket.
///
///   offset  size  little endian
///        0     4  magic 0x31535050, the characters "PPS1"
///        4     4  edge: 1 = assert, 2 = clear (RFC 2783)
///        8     8  sequence: how many edges of this kind the source has seen, as the kernel counts them; gaps are lost
///        edges
///       16     8  HostTime of the edge, signed ns (CLOCK_MONOTONIC_RAW of the machine that reads it)
namespace hueline::drivers {

constexpr std::uint32_t kPpsMagic = 0x31535050;
constexpr std::size_t kPpsPacketSize = 24;

/// RFC 2783 names. Which one is the second depends on the wiring: a USB or RS-232 level converter inverts.
enum class PpsEdgeKind : std::uint8_t { Assert = 1, Clear = 2 };
const char* name(PpsEdgeKind kind);

struct PpsPacket {
  PpsEdgeKind edge = PpsEdgeKind::Assert;
  std::uint64_t sequence = 0;
  HostTime time{};  ///< the edge at the input, as the interrupt saw it
};

std::array<std::byte, kPpsPacketSize> encode_pps(const PpsPacket& packet);
/// Malformed: wrong size, magic or edge.
Result<PpsPacket> decode_pps(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
