#pragma once

#include <cstdint>

#include "storage/byte_order.hpp"

/// CRC-32 of IEEE 802.3 (zlib's), as MCAP and PNG use it.
namespace hueline::storage {

/// Goes on from `crc` (0 at the start).
std::uint32_t crc32(std::uint32_t crc, ByteView bytes);

/// The CRC of A followed by B from the CRCs of A and of B and the length of B, without touching the bytes again: a
/// chunk of images is run over once for its own CRC, and the file's CRC follows from that.
std::uint32_t crc32_combine(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b);

}  // namespace hueline::storage
