#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/buffer.hpp"
#include "core/pixel_rows.hpp"
#include "core/result.hpp"
#include "storage/byte_order.hpp"

/// Packs uncompressed images without loss, as fast as memory is read: of each sample its difference from the sample of
/// the same colour above is stored, in as many bits as the largest of 32 differences needs (docs/formats.md). No table
/// and no state goes from one image to the next.
namespace hueline::storage {

/// Returns the most bytes that pack_rows() writes for a payload of so many; 0 if `rows` do not fit in it, or it has
/// more than 1 GiB.
std::size_t packed_rows_bound(std::size_t payload_bytes, const PixelRows& rows);

/// Packs `payload`, whose samples lie in `rows`, into `out`, which has packed_rows_bound() bytes. Returns the number of
/// bytes written; 0 if the bound is 0, or if the packed bytes would not be fewer. The same bytes come from every
/// processor.
std::size_t pack_rows(ByteView payload, const PixelRows& rows, std::span<std::byte> out);

/// A payload as it was, and where its samples lie.
struct UnpackedRows {
  Buffer payload;
  PixelRows rows;
};
/// Unpacks what pack_rows() wrote. Error: Malformed, for other bytes. The memory that it takes is at most 64 times the
/// packed bytes, and at most 1 GiB.
Result<UnpackedRows> unpack_rows(ByteView packed);

}  // namespace hueline::storage
