#pragma once

#include <vector>

#include "storage/las_format.hpp"
#include "storage/laz_chunk.hpp"

/// What a LAZ file has besides its chunks of points: the record that describes the compression, and the table of
/// chunks. Source: the published LASzip format.
namespace hueline::storage {

constexpr std::uint16_t kLazRecord = 22204;        ///< number of the record "laszip encoded"
constexpr std::uint8_t kLazFlag = 0x80;            ///< bit of the point format in the header of a compressed file
constexpr std::uint32_t kLazChunkPoints = 50'000;  ///< points in each chunk but the last, as most programs write
constexpr std::uint32_t kLazVariableChunks = 0xFFFFFFFF;  ///< instead of a number of points: the table has it

/// Returns the record "laszip encoded". `chunk_points`: points in a chunk, or kLazVariableChunks.
LasVlr laz_vlr(const LazRecord& kind, std::uint32_t chunk_points);
/// What such a record states.
struct LazCompression {
  std::uint32_t chunk_points = 0;  ///< points in a chunk, or kLazVariableChunks
  int item_version = 3;            ///< as in LazRecord
};
/// Reads the data of such a record. Errors: Malformed; Unsupported if the points are compressed in another way than
/// encode_laz_chunk() does.
Result<LazCompression> read_laz_vlr(ByteView data, const LazRecord& kind);

/// Returns the table: bytes of each chunk, and its points if the chunks have different numbers of points.
Bytes encode_laz_table(const std::vector<LazChunkSize>& chunks, bool has_points);
/// Reads a table; the points are 0 if it does not have them. Error: Malformed, also if it counts more than `most`
/// chunks.
Result<std::vector<LazChunkSize>> decode_laz_table(ByteView bytes, bool has_points, std::uint64_t most);

}  // namespace hueline::storage
