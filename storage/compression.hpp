#pragma once

#include "core/result.hpp"
#include "storage/byte_order.hpp"

/// The chunk compressions that the MCAP specification names: LZ4 frame, Zstandard, none.
namespace hueline::storage {

enum class Compression : std::uint8_t { None, Lz4, Zstd };
/// As written in the file: "", "lz4", "zstd".
const char* mcap_name(Compression compression);

/// Appends the compressed `pieces`, taken as one run of bytes, to `out`. The same input gives the same bytes. Not for
/// None.
Status compress(Compression compression, std::span<const ByteView> pieces, Bytes& out);

/// Decompresses into exactly `out.size()` bytes; Malformed if the content is broken or of another size, Unsupported for
/// a compression we do not know.
Status decompress(const std::string& mcap_name, ByteView compressed, std::span<std::byte> out);

}  // namespace hueline::storage
