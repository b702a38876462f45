#include "storage/laz_format.hpp"

#include <array>
#include <string>

#include "storage/arithmetic_coder.hpp"

namespace hueline::storage {
namespace {

constexpr std::uint16_t kPointAfterPoint = 2, kLayeredChunks = 3, kArithmetic = 0;  // kinds of compression
/// Numbers of the items of a record.
enum Item : std::uint16_t {
  kByteItem = 0,
  kPoint10Item = 6,
  kGpsTime11Item = 7,
  kRgb12Item = 8,
  kPoint14Item = 10,
  kRgb14Item = 11,
  kRgbNir14Item = 12,
  kByte14Item = 14
};

struct ItemSize {
  Item item;
  std::size_t size;
};
std::vector<ItemSize> items_of(const LazRecord& kind) {
  std::vector<ItemSize> items;
  if (kind.is_layered()) {
    items.push_back({kPoint14Item, 30});
    if (kind.format == 7) items.push_back({kRgb14Item, 6});
    if (kind.format == 8) items.push_back({kRgbNir14Item, 8});
  } else {
    items.push_back({kPoint10Item, 20});
    if (kind.format & 1) items.push_back({kGpsTime11Item, 8});
    if (kind.format >= 2) items.push_back({kRgb12Item, 6});
  }
  if (const std::size_t extra = kind.size - las_point_size(kind.format); extra > 0)
    items.push_back({kind.is_layered() ? kByte14Item : kByteItem, extra});
  return items;
}

/// Codes the entries of a table, each as the difference to the one before.
template <class Coder>
void code_table(Coder& coder, std::vector<LazChunkSize>& chunks, bool has_points) {
  IntegerModel model(32, 2);
  LazChunkSize last;
  const auto code = [&](std::uint64_t before, std::uint64_t value, std::size_t context) {
    return static_cast<std::uint32_t>(
        model.code(coder, static_cast<std::int32_t>(before), static_cast<std::int32_t>(value), context));
  };
  for (LazChunkSize& chunk : chunks) {
    if (has_points) chunk.points = code(last.points, chunk.points, 0);
    chunk.bytes = code(last.bytes, chunk.bytes, 1);
    last = chunk;
  }
}

}  // namespace

LasVlr laz_vlr(const LazRecord& kind, std::uint32_t chunk_points) {
  Bytes data;
  append(data, kind.is_layered() ? kLayeredChunks : kPointAfterPoint);
  append(data, kArithmetic);
  append(data, std::uint8_t{3}), append(data, std::uint8_t{4});  // version of the format: 3.4
  append(data, std::uint16_t{0});
  append(data, std::uint32_t{0});  // options
  append(data, chunk_points);
  append(data, std::int64_t{-1}), append(data, std::int64_t{-1});  // special records behind the points: none
  const std::vector<ItemSize> items = items_of(kind);
  append(data, static_cast<std::uint16_t>(items.size()));
  for (const ItemSize& item : items) {
    append(data, static_cast<std::uint16_t>(item.item));
    append(data, static_cast<std::uint16_t>(item.size));
    append(data, static_cast<std::uint16_t>(kind.is_layered() ? 3 : 2));
  }
  return {"laszip encoded", kLazRecord, "compression of the points",
          std::string(reinterpret_cast<const char*>(data.data()), data.size())};
}

Result<LazCompression> read_laz_vlr(ByteView data, const LazRecord& kind) {
  ByteReader in(data);
  const auto compressor = in.take<std::uint16_t>(), coder = in.take<std::uint16_t>();
  in.take_bytes(1 + 1 + 2 + 4);
  const auto chunk_points = in.take<std::uint32_t>();
  in.take_bytes(8 + 8);
  const auto count = in.take<std::uint16_t>();
  const std::uint16_t expected = kind.is_layered() ? kLayeredChunks : kPointAfterPoint;
  if (in.ok() && (compressor != expected || coder != kArithmetic))
    return Error{ErrorCode::Unsupported, "points of format " + std::to_string(kind.format) + " with the compression " +
                                             std::to_string(compressor) + " of LASzip: " + std::to_string(expected) +
                                             " is read; unpack the file first"};
  const std::vector<ItemSize> items = items_of(kind);
  LazCompression out;
  bool fits = count == items.size(), is_old = false;
  for (std::size_t i = 0; i < count && fits; ++i) {
    const auto item = in.take<std::uint16_t>(), size = in.take<std::uint16_t>(), version = in.take<std::uint16_t>();
    fits = item == items[i].item && size == items[i].size;
    is_old = is_old || !(kind.is_layered() ? version == 3 || version == 4 : version == 2);
    if (kind.is_layered()) out.item_version = version;
  }
  if (!in.ok() || !fits)
    return Error{ErrorCode::Malformed, "the LAZ record does not describe the points that the header describes"};
  if (is_old)
    return Error{ErrorCode::Unsupported,
                 "points that another version of LASzip than 2 to 4 compressed; unpack the file first"};
  // LASzip takes 0 for chunks of any size.
  out.chunk_points = chunk_points == 0 ? kLazVariableChunks : chunk_points;
  return out;
}

Bytes encode_laz_table(const std::vector<LazChunkSize>& chunks, bool has_points) {
  Bytes out;
  append(out, std::uint32_t{0});  // version
  append(out, static_cast<std::uint32_t>(chunks.size()));
  if (chunks.empty()) return out;
  ArithmeticEncoder coder;
  std::vector<LazChunkSize> entries = chunks;
  code_table(coder, entries, has_points);
  append(out, coder.finish());
  return out;
}

Result<std::vector<LazChunkSize>> decode_laz_table(ByteView bytes, bool has_points, std::uint64_t most) {
  ByteReader in(bytes);
  const auto version = in.take<std::uint32_t>(), count = in.take<std::uint32_t>();
  if (!in.ok() || version != 0 || count > most)
    return Error{ErrorCode::Malformed, "the table of the compressed chunks is damaged"};
  std::vector<LazChunkSize> chunks(count);
  if (count == 0) return chunks;
  ArithmeticDecoder coder(in.take_bytes(in.remaining()));
  code_table(coder, chunks, has_points);
  if (coder.passed_end()) return Error{ErrorCode::Malformed, "the table of the compressed chunks is damaged"};
  return chunks;
}

}  // namespace hueline::storage
