#pragma once

#include "core/result.hpp"
#include "storage/byte_order.hpp"

/// One chunk of a LAZ file: point records that are compressed on their own, in one of the two schemes of LASzip. What a
/// field's probabilities depend on is a fact of the format.
/// - Point formats 6 to 8, of LAS 1.4: layered chunks (versions 3 and 4 of POINT14, RGB14, RGBNIR14 and BYTE14). The
///   first record as it is, the number of records, the sizes of the layers, the layers. A layer holds one field, or one
///   byte of the extra bytes; its size is 0 if all records have the same value.
/// - Point formats 0 to 3: version 2 of POINT10, GPSTIME11, RGB12 and BYTE. The first record as it is, and all others
///   one after the other. Only the file knows how many there are.
/// Thread safety: different threads may call these functions at the same time.
namespace hueline::storage {

/// The kind of the records: point format, and the size with the extra bytes.
struct LazRecord {
  int format = 7;
  std::size_t size = 36;
  /// Version of the items of layered chunks, 3 or 4. They differ in what colours and extra bytes are compared with
  /// where the scanner channel changes. Without several channels there is no difference.
  int item_version = 3;
  /// Returns whether its chunks are layered, so that they state their sizes.
  bool is_layered() const { return format >= 6; }
};

/// The point formats that can be compressed, for messages.
constexpr const char* kLazFormats = "0 to 3 and 6 to 8";
/// Returns whether the functions below compress records of this kind.
bool is_laz_record(const LazRecord& kind);

/// Compresses whole records, at least one and at most 2^32 - 1. The same records give the same bytes.
Bytes encode_laz_chunk(ByteView records, const LazRecord& kind);

/// The sizes of a compressed chunk.
struct LazChunkSize {
  std::uint64_t bytes = 0;
  std::uint32_t points = 0;
};
/// Returns the number of bytes before the layers of a layered chunk.
std::size_t laz_chunk_head(const LazRecord& kind);
/// Returns the size of the layered chunk that begins with `head`, which has the bytes before the layers at least.
LazChunkSize measure_laz_chunk(ByteView head, const LazRecord& kind);

/// Replaces `records` by those of the chunk, and returns how many bytes of `chunk` it has. A layered chunk must have at
/// most `most` points, another one has as many; 4 million, and 1 GiB of records, are the most for both. Errors:
/// Truncated; Malformed if the chunk contradicts itself.
Result<std::size_t> decode_laz_chunk(ByteView chunk, const LazRecord& kind, std::size_t most, Bytes& records);

}  // namespace hueline::storage
