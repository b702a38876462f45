#include "storage/laz_chunk.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "storage/las_format.hpp"
#include "storage/laz_items.hpp"
#include "storage/laz_layers.hpp"

namespace hueline::storage {
namespace {

using namespace laz;

/// The most points in a chunk that is read: a damaged count must not take all memory.
std::size_t most_points(const LazRecord& kind) { return std::min<std::size_t>(1 << 22, (1u << 30) / kind.size); }
constexpr std::size_t kBlock = 512;  // records that all layers code before the next: they stay in the nearest cache

/// Layers of the format's point, in the order of the file; those of colours and extra bytes follow.
enum Fixed : std::size_t { kPlace, kHeight, kClasses, kFlagBits, kIntensities, kAngles, kUsers, kSources, kTimes };

std::size_t layer_count(const LazRecord& kind) {
  return 9 + (kind.format >= 7 ? 1 : 0) + (kind.format == 8 ? 1 : 0) + kind.size - las_point_size(kind.format);
}

/// The layers of the point in one scanner channel. The first record of a channel is compared with the record before it.
struct PointLayers {
  PlaceLayer place;
  ZLayer z;
  ClassLayer classes;
  FlagsLayer flags;
  IntensityLayer intensity;
  AngleLayer angle;
  UserLayer user;
  SourceLayer source;
  TimeLayer time;
};

/// The layers of colours and extra bytes in one context, which is the scanner channel from version 4 of the items on.
struct AdditionLayers {
  explicit AdditionLayers(const LazRecord& kind) {
    for (std::size_t at = las_point_size(kind.format); at < kind.size; ++at) bytes.emplace_back(at);
  }
  ColourLayer colours;
  NirLayer nirs;
  std::vector<ByteLayer> bytes;
};

/// All layers of a chunk, coded in blocks of records.
template <class Coder>
class Layers {
 public:
  using Byte = std::conditional_t<Coder::kDecodes, std::byte, const std::byte>;

  /// `coders` has the coder of each layer, or nothing where no record differs from the first one.
  Layers(Byte* first, const LazRecord& kind, std::vector<std::optional<Coder>>& coders)
      : first_(first), kind_(kind), coders_(coders) {
    std::size_t layer = 9;
    if (kind.format >= 7) colour_ = layer++;
    if (kind.format == 8) nir_ = layer++;
    first_byte_ = layer;
    channel_ = context_ = channel_of(first);
    points_[channel_] = std::make_unique<PointLayers>();
    additions_[context_] = std::make_unique<AdditionLayers>(kind);
    last_[channel_] = last_addition_[context_] = first;
  }

  /// Codes the records behind the first one.
  void code(std::size_t count) {
    std::vector<Coded> coded(kBlock);
    for (std::size_t begin = 1; begin < count; begin += kBlock) {
      const std::size_t size = std::min(kBlock, count - begin);
      Byte* const records = first_ + begin * kind_.size;
      for (std::size_t i = 0; i < size; ++i) coded[i] = code_place(records + i * kind_.size);
      const auto code_point = [&](std::size_t layer, auto PointLayers::*fields) {
        if (!coders_[layer]) return;
        for (std::size_t i = 0; i < size; ++i)
          (points_[coded[i].channel].get()->*fields)
              .code(*coders_[layer], records + i * kind_.size, coded[i].last, coded[i].step);
      };
      const auto code_addition = [&](std::size_t layer, const auto& fields_of) {
        if (!coders_[layer]) return;
        for (std::size_t i = 0; i < size; ++i)
          fields_of(*additions_[coded[i].context])
              .code(*coders_[layer], records + i * kind_.size, coded[i].last_addition, coded[i].step);
      };
      code_point(kHeight, &PointLayers::z);
      code_point(kClasses, &PointLayers::classes);
      code_point(kFlagBits, &PointLayers::flags);
      code_point(kIntensities, &PointLayers::intensity);
      code_point(kAngles, &PointLayers::angle);
      code_point(kUsers, &PointLayers::user);
      code_point(kSources, &PointLayers::source);
      code_point(kTimes, &PointLayers::time);
      if (colour_)
        code_addition(
            colour_, [](AdditionLayers & of) -> auto& { return of.colours; });
      if (nir_)
        code_addition(
            nir_, [](AdditionLayers & of) -> auto& { return of.nirs; });
      for (std::size_t k = 0; k < kind_.size - las_point_size(kind_.format); ++k)
        code_addition(
            first_byte_ + k, [k](AdditionLayers & of) -> auto& { return of.bytes[k]; });
    }
  }

 private:
  /// What the first layer found out about a record, and which records the others compare it with.
  struct Coded {
    Step step;
    std::size_t channel, context;
    const std::byte *last, *last_addition;
  };

  Coded code_place(Byte* record) {
    Coder& coder = *coders_[kPlace];
    const std::size_t before = channel_, given = Coder::kDecodes ? before : channel_of(record);
    auto steps = static_cast<std::uint32_t>(given - before) & 3u;
    const std::uint32_t change = points_[before]->place.code_change(
        coder, record, last_[before], points_[given] ? last_[given] : last_[before], steps);
    channel_ = (before + steps) & 3u;
    if (!points_[channel_]) {
      points_[channel_] = std::make_unique<PointLayers>();
      last_[channel_] = last_[before];
    }
    store<Coder>(record, kFlags,
                 static_cast<std::uint8_t>((load<std::uint8_t>(record, kFlags) & 0xCF) | channel_ << 4));
    const std::size_t compared = enter_context(steps != 0);
    Coded out{points_[channel_]->place.code(coder, change, record, last_[channel_]), channel_, context_,
              last_[channel_], last_addition_[compared]};
    last_[channel_] = record;
    last_addition_[compared] = record;
    return out;
  }

  /// Chooses the context of the additions. Returns with whose last record they are compared. LASzip knew the channel,
  /// in version 3 of its items, only for a record that changes it, and took 0 for all others; and it went on with the
  /// last record of the context before where it returned to another.
  std::size_t enter_context(bool has_changed) {
    const bool is_right = kind_.item_version >= 4;
    const std::size_t before = context_;
    context_ = is_right || has_changed ? channel_ : 0;
    const bool is_new = !additions_[context_];
    if (is_new) {
      additions_[context_] = std::make_unique<AdditionLayers>(kind_);
      last_addition_[context_] = last_addition_[before];
    }
    return is_right || is_new ? context_ : before;
  }

  Byte* first_;
  LazRecord kind_;
  std::vector<std::optional<Coder>>& coders_;
  std::array<std::unique_ptr<PointLayers>, 4> points_;        // by channel
  std::array<std::unique_ptr<AdditionLayers>, 4> additions_;  // by context
  std::array<const std::byte*, 4> last_{}, last_addition_{};  // the last record of each
  std::size_t channel_ = 0, context_ = 0;                     // of the record before
  std::size_t colour_ = 0, nir_ = 0, first_byte_ = 0;         // layers; 0: not in this format
};

/// Returns for each byte of a record which of its bits differ in any record from the first one.
Bytes differing_bits(ByteView records, std::size_t size) {
  Bytes bits(size);
  for (std::size_t at = size; at + size <= records.size(); at += size)
    for (std::size_t i = 0; i < size; ++i) bits[i] |= records[at + i] ^ records[i];
  return bits;
}

/// Returns whether a layer has to be coded. The first two are always in the file.
std::vector<bool> changing_layers(const Bytes& bits, const LazRecord& kind) {
  const auto any = [&](std::size_t at, std::size_t size) {
    return std::any_of(&bits[at], &bits[at] + size, [](std::byte b) { return b != std::byte{0}; });
  };
  std::vector<bool> out{true,
                        true,
                        any(kClass, 1),
                        (bits[kFlags] & std::byte{0xCF}) != std::byte{0},
                        any(kIntensity, 2),
                        any(kAngle, 2),
                        any(kUser, 1),
                        any(kSource, 2),
                        any(kTime, 8)};
  if (kind.format >= 7) out.push_back(any(kRed, 6));
  if (kind.format == 8) out.push_back(any(kNir, 2));
  for (std::size_t at = las_point_size(kind.format); at < kind.size; ++at) out.push_back(any(at, 1));
  return out;
}

Bytes encode_layered(ByteView records, const LazRecord& kind) {
  const std::size_t count = records.size() / kind.size;
  const Bytes bits = differing_bits(records, kind.size);
  const std::vector<bool> changes = changing_layers(bits, kind);
  std::vector<std::optional<ArithmeticEncoder>> coders(changes.size());
  for (std::size_t layer = 0; layer < coders.size(); ++layer)
    if (changes[layer]) coders[layer].emplace();
  Layers<ArithmeticEncoder> layers(records.data(), kind, coders);
  layers.code(count);

  Bytes out(records.begin(), records.begin() + static_cast<std::ptrdiff_t>(kind.size));
  append(out, static_cast<std::uint32_t>(count));
  std::vector<Bytes> coded;
  for (auto& coder : coders) {
    coded.push_back(coder ? coder->finish() : Bytes{});
    append(out, static_cast<std::uint32_t>(coded.back().size()));
  }
  for (const Bytes& layer : coded) append(out, layer);
  return out;
}

Result<std::size_t> decode_layered(ByteView chunk, const LazRecord& kind, std::size_t most, Bytes& records) {
  if (chunk.size() < laz_chunk_head(kind)) return Error{ErrorCode::Truncated, "the chunk ends before its layers"};
  const LazChunkSize size = measure_laz_chunk(chunk, kind);
  if (size.bytes > chunk.size()) return Error{ErrorCode::Truncated, "the chunk ends inside its layers"};
  if (size.points == 0 || size.points > most)
    return Error{ErrorCode::Malformed, "it counts " + std::to_string(size.points) + " points, and " +
                                           std::to_string(most) + " are the most that it can have"};
  // Unchanged fields are those of the first record.
  records.resize(size.points * kind.size);
  for (std::size_t at = 0; at < records.size(); at += kind.size) std::memcpy(&records[at], chunk.data(), kind.size);
  std::vector<std::optional<ArithmeticDecoder>> coders(layer_count(kind));
  ByteReader sizes(chunk.subspan(kind.size + 4)), layers_in(chunk.subspan(laz_chunk_head(kind)));
  for (auto& coder : coders)
    if (const auto layer = layers_in.take_bytes(sizes.take<std::uint32_t>()); !layer.empty()) coder.emplace(layer);
  if (size.points > 1 && (!coders[kPlace] || !coders[kHeight]))
    return Error{ErrorCode::Malformed, "it has no layer of places"};
  Layers<ArithmeticDecoder> layers(records.data(), kind, coders);
  layers.code(size.points);
  for (const auto& coder : coders)
    if (coder && coder->passed_end()) return Error{ErrorCode::Malformed, "it is damaged: a layer ends too early"};
  return static_cast<std::size_t>(size.bytes);
}

}  // namespace

bool is_laz_record(const LazRecord& kind) {
  const bool has_scheme = (kind.format >= 0 && kind.format <= 3) || (kind.format >= 6 && kind.format <= 8);
  return has_scheme && kind.size >= las_point_size(kind.format) && kind.size <= 0xFFFF;
}

/// These are the first record, the number of records, and the size of each layer.
std::size_t laz_chunk_head(const LazRecord& kind) { return kind.size + 4 + 4 * layer_count(kind); }

LazChunkSize measure_laz_chunk(ByteView head, const LazRecord& kind) {
  ByteReader in(head);
  in.take_bytes(kind.size);
  LazChunkSize size{laz_chunk_head(kind), in.take<std::uint32_t>()};
  for (std::size_t layer = 0; layer < layer_count(kind); ++layer) size.bytes += in.take<std::uint32_t>();
  return size;
}

Bytes encode_laz_chunk(ByteView records, const LazRecord& kind) {
  if (kind.is_layered()) return encode_layered(records, kind);
  Bytes out(records.begin(), records.begin() + static_cast<std::ptrdiff_t>(kind.size));
  ArithmeticEncoder coder;
  Items<ArithmeticEncoder>(kind).code(coder, records.data(), records.size() / kind.size);
  append(out, coder.finish());
  return out;
}

Result<std::size_t> decode_laz_chunk(ByteView chunk, const LazRecord& kind, std::size_t most, Bytes& records) {
  if (kind.is_layered()) return decode_layered(chunk, kind, std::min(most, most_points(kind)), records);
  if (most == 0 || most > most_points(kind))
    return Error{ErrorCode::Malformed, "it has " + std::to_string(most) + " points: 1 to " +
                                           std::to_string(most_points(kind)) + " can be read"};
  if (chunk.size() < kind.size) return Error{ErrorCode::Truncated, "the chunk ends inside its first point"};
  records.resize(most * kind.size);
  std::memcpy(records.data(), chunk.data(), kind.size);
  ArithmeticDecoder coder(chunk.subspan(kind.size));
  Items<ArithmeticDecoder>(kind).code(coder, records.data(), most);
  if (most > 1 && coder.passed_end()) return Error{ErrorCode::Malformed, "it is damaged: it ends too early"};
  return kind.size + coder.used();
}

}  // namespace hueline::storage
