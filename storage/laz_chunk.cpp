#include "storage/laz_chunk.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "storage/laz_layers.hpp"

namespace hueline::storage {
namespace {

using namespace laz;

constexpr std::size_t kMostPoints = 1 << 22;  // in a chunk that is read; a damaged count must not take all memory
constexpr std::size_t kBlock = 512;  // records that all layers code before the next: they stay in the nearest cache

/// Layers of the format's point, in the order of the file; those of colours and extra bytes follow.
enum Fixed : std::size_t { kPlace, kHeight, kClasses, kFlagBits, kIntensities, kAngles, kUsers, kSources, kTimes };

std::size_t base_size(int format) { return format == 6 ? 30 : format == 7 ? 36 : 38; }
std::size_t layer_count(const LazRecord& kind) {
  return 9 + (kind.format >= 7 ? 1 : 0) + (kind.format == 8 ? 1 : 0) + kind.size - base_size(kind.format);
}

/// All layers of a chunk, coded in blocks of records.
template <class Coder>
class Layers {
 public:
  using Byte = std::conditional_t<Coder::kDecodes, std::byte, const std::byte>;

  /// `coders` has the coder of each layer, or nothing where no record differs from the first one.
  Layers(Byte* first, const LazRecord& kind, std::vector<std::optional<Coder>>& coders)
      : first_(first), size_(kind.size), coders_(coders), z_(first), intensity_(first), time_(first) {
    std::size_t layer = 9;
    if (kind.format >= 7) colour_ = layer++;
    if (kind.format == 8) nir_ = layer++;
    first_byte_ = layer;
    for (std::size_t at = base_size(kind.format); at < kind.size; ++at) bytes_.emplace_back(at);
  }

  /// Codes the records behind the first one. Returns false if the scanner channel changes.
  bool code(std::size_t count) {
    std::vector<Step> steps(kBlock);
    for (std::size_t begin = 1; begin < count && !place_.changes_channel(); begin += kBlock) {
      const std::size_t size = std::min(kBlock, count - begin);
      Byte* const records = first_ + begin * size_;
      for (std::size_t i = 0; i < size; ++i)
        steps[i] = place_.code(*coders_[kPlace], records + i * size_, records + i * size_ - size_);
      const auto code_layer = [&](std::size_t layer, auto& fields) {
        if (!coders_[layer]) return;
        for (std::size_t i = 0; i < size; ++i)
          fields.code(*coders_[layer], records + i * size_, records + i * size_ - size_, steps[i]);
      };
      code_layer(kHeight, z_);
      code_layer(kClasses, class_);
      code_layer(kFlagBits, flags_);
      code_layer(kIntensities, intensity_);
      code_layer(kAngles, angle_);
      code_layer(kUsers, user_);
      code_layer(kSources, source_);
      code_layer(kTimes, time_);
      if (colour_) code_layer(colour_, colours_);
      if (nir_) code_layer(nir_, nirs_);
      for (std::size_t i = 0; i < bytes_.size(); ++i) code_layer(first_byte_ + i, bytes_[i]);
    }
    return !place_.changes_channel();
  }

 private:
  Byte* first_;
  std::size_t size_;
  std::vector<std::optional<Coder>>& coders_;
  PlaceLayer place_;
  ZLayer z_;
  ClassLayer class_;
  FlagsLayer flags_;
  IntensityLayer intensity_;
  UserLayer user_;
  AngleLayer angle_;
  SourceLayer source_;
  TimeLayer time_;
  std::size_t colour_ = 0, nir_ = 0, first_byte_ = 0;  // layers; 0: not in this format
  ColourLayer colours_;
  NirLayer nirs_;
  std::vector<ByteLayer> bytes_;
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
  std::vector<bool> out{true,           true,          any(kClass, 1),  any(kFlags, 1), any(kIntensity, 2),
                        any(kAngle, 2), any(kUser, 1), any(kSource, 2), any(kTime, 8)};
  if (kind.format >= 7) out.push_back(any(kRed, 6));
  if (kind.format == 8) out.push_back(any(kNir, 2));
  for (std::size_t at = base_size(kind.format); at < kind.size; ++at) out.push_back(any(at, 1));
  return out;
}

}  // namespace

bool is_laz_record(const LazRecord& kind) {
  return kind.format >= 6 && kind.format <= 8 && kind.size >= base_size(kind.format) && kind.size <= 0xFFFF;
}

/// These are the first record, the number of records, and the size of each layer.
std::size_t laz_chunk_head(const LazRecord& kind) { return kind.size + 4 + 4 * layer_count(kind); }

Result<Bytes> encode_laz_chunk(ByteView records, const LazRecord& kind) {
  const std::size_t count = records.size() / kind.size;
  const Bytes bits = differing_bits(records, kind.size);
  if ((bits[kFlags] & std::byte{0x30}) != std::byte{0})
    return Error{ErrorCode::Invalid, "the points have several scanner channels: a LAZ file of this program has one"};
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

LazChunkSize measure_laz_chunk(ByteView head, const LazRecord& kind) {
  ByteReader in(head);
  in.take_bytes(kind.size);
  LazChunkSize size{laz_chunk_head(kind), in.take<std::uint32_t>()};
  for (std::size_t layer = 0; layer < layer_count(kind); ++layer) size.bytes += in.take<std::uint32_t>();
  return size;
}

Status decode_laz_chunk(ByteView chunk, const LazRecord& kind, std::size_t most, Bytes& records) {
  if (chunk.size() < laz_chunk_head(kind)) return Error{ErrorCode::Truncated, "the chunk ends before its layers"};
  const LazChunkSize size = measure_laz_chunk(chunk, kind);
  if (size.bytes > chunk.size()) return Error{ErrorCode::Truncated, "the chunk ends inside its layers"};
  most = std::min(most, kMostPoints);
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
  if (!layers.code(size.points))
    return Error{ErrorCode::Unsupported, "the points have several scanner channels, which is not read from LAZ"};
  for (const auto& coder : coders)
    if (coder && coder->passed_end()) return Error{ErrorCode::Malformed, "it is damaged: a layer ends too early"};
  return {};
}

}  // namespace hueline::storage
