#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"
#include "core/time.hpp"

/// The layout of a packet of a PTP hardware clock: one comparison of that clock with the computer's. 32 bytes, little
/// endian:
///
///   offset  size  field
///        0     4  magic 0x31505450, the characters "PTP1"
///        4     4  half of the time that the comparison took, ns; 0 if the hardware reads both clocks at once
///        8     8  number of comparisons so far, from 1
///       16     8  reading of the PTP clock, signed ns since its own beginning
///       24     8  HostTime of that reading, signed ns (CLOCK_MONOTONIC_RAW of the computer)
namespace hueline::drivers {

constexpr std::uint32_t kPtpMagic = 0x31505450;
constexpr std::size_t kPtpPacketSize = 32;

/// The fields of the packet.
struct PtpPacket {
  nanoseconds half_window{0};
  std::uint64_t sequence = 0;
  nanoseconds clock{0};
  HostTime host{};
};

/// Encodes a packet.
std::array<std::byte, kPtpPacketSize> encode_ptp(const PtpPacket& packet);
/// Decodes a packet. Error: Malformed (wrong size or magic).
Result<PtpPacket> decode_ptp(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
