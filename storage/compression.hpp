#pragma once

#include <string>

#include "core/result.hpp"
#include "storage/byte_order.hpp"

/// The chunk compressions that the MCAP specification names: LZ4 frames, Zstandard, none.
namespace hueline::storage {

enum class Compression : std::uint8_t { None, Lz4, Zstd };
/// Returns the name that stands in the file: "", "lz4" or "zstd".
const char* mcap_name(Compression compression);

/// Compresses `pieces` as one run of bytes and appends the result to `out`. The same input gives the same bytes.
/// `compression` must not be None.
Status compress(Compression compression, std::span<const ByteView> pieces, Bytes& out);

/// Decompresses into exactly `out.size()` bytes. Errors: Malformed if the content is broken or has another size;
/// Unsupported if the compression is unknown.
Status decompress(const std::string& mcap_name, ByteView compressed, std::span<std::byte> out);

}  // namespace hueline::storage
