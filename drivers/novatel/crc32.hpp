#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace hueline::drivers {

/// Computes NovAtel's CRC-32 (OEM7 manual, "32-Bit CRC"). It has the reflected polynomial 0xEDB88320 of zip and
/// Ethernet, but starts at 0 and has no final inversion. A message's CRC covers its header and body; it follows the
/// body as four bytes, little endian.
std::uint32_t novatel_crc32(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
