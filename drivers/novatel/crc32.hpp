#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace hueline::drivers {

/// NovAtel's CRC-32 (OEM7 manual, "32-Bit CRC"): the reflected polynomial 0xEDB88320 of zip and Ethernet, but with
/// starting value 0 and without the final inversion. Over header and body; the four bytes behind the body hold it,
/// little-endian.
std::uint32_t novatel_crc32(std::span<const std::byte> bytes);

}  // namespace hueline::drivers
