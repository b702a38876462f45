#pragma once

#include <cstdint>

#include "storage/byte_order.hpp"

/// The CRC-32 of IEEE 802.3 (as in zlib), which MCAP and PNG use.
namespace hueline::storage {

/// Returns the CRC of the bytes seen before, whose CRC is `crc` (0 at the start), followed by `bytes`.
std::uint32_t crc32(std::uint32_t crc, ByteView bytes);

/// Returns the CRC of A followed by B from the CRC of A, the CRC of B and the length of B, without reading the bytes
/// again. So the bytes of a chunk of images are read once, for the chunk's own CRC, and the file's CRC follows from it.
std::uint32_t crc32_combine(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b);

}  // namespace hueline::storage
