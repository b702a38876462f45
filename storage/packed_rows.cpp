// This file is compiled once for each instruction set that the compiler supports. The program selects the best set of
// the processor at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "storage/packed_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "storage/packed_rows.hpp"

#ifndef HUELINE_STORAGE_PACKED_ROWS_ONCE
#define HUELINE_STORAGE_PACKED_ROWS_ONCE
namespace hueline::storage {
constexpr std::size_t kRowBlock = 32;               // samples that have the same number of bits
constexpr std::size_t kPlaneBytes = kRowBlock / 8;  // one bit of each of them
constexpr std::size_t kMaskSlack = 8;               // bytes that loading and storing of masks may touch
constexpr std::uint8_t kPackedRowsVersion = 1;
constexpr std::size_t kPackedRowsHead = 24;

constexpr std::uint64_t kMostUnpacked = std::uint64_t{1} << 30;  // bytes of an image

constexpr std::size_t blocks_of(std::size_t stride, std::size_t sample_bytes) {
  return (stride / sample_bytes + kRowBlock - 1) / kRowBlock;
}
/// Bytes of the numbers of bits of so many blocks: four bits each for samples of one byte, else a byte each.
constexpr std::size_t width_bytes(std::size_t blocks, std::size_t sample_bytes) {
  return sample_bytes == 1 ? (blocks + 1) / 2 : blocks;
}

/// The rows of an image in memory.
struct RowsView {
  const std::uint8_t* samples;
  const std::uint8_t* zeros;  // a row of them, which stands above the first rows
  std::size_t stride, rows, colour_rows;
  int shift;  // low bits that are 0 in every sample
};
}  // namespace hueline::storage
#endif

HWY_BEFORE_NAMESPACE();
namespace hueline::storage::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// As many lanes as the processor has, at most a block of them.
template <class Sample>
using SampleTag = hn::CappedTag<Sample, kRowBlock>;

/// Loads samples, which may lie at any address.
template <class D>
HWY_INLINE hn::Vec<D> load(D d, const std::uint8_t* samples, std::size_t at) {
  using Sample = hn::TFromD<D>;
  return hn::LoadU(d, reinterpret_cast<const Sample*>(samples + at * sizeof(Sample)));
}

/// Returns the differences of samples with the sign in the lowest bit, so that small ones have few bits.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V folded(D d, V samples, V above) {
  const hn::RebindToSigned<D> is;
  const auto difference = hn::BitCast(is, hn::Sub(samples, above));
  const auto sign = hn::BitCast(d, hn::VecFromMask(is, hn::Lt(difference, hn::Zero(is))));
  const auto twice = hn::BitCast(d, hn::Add(difference, difference));
  return hn::Xor(twice, sign);
}

/// Returns the bits that are set in any sample of a block.
template <class Sample>
HWY_INLINE Sample any_of(const Sample* block) {
  std::array<std::uint64_t, kRowBlock * sizeof(Sample) / 8> words;
  std::memcpy(words.data(), block, sizeof words);
  std::uint64_t any = 0;
  for (const std::uint64_t word : words) any |= word;
  any |= any >> 32;
  any |= any >> 16;
  if constexpr (sizeof(Sample) == 1) any |= any >> 8;
  return static_cast<Sample>(any);
}

/// Writes the bits of the lanes from sample `at` on to their places in a plane. Lanes come in order: the first ones of
/// a byte clear it.
template <class D, class M>
HWY_INLINE void store_bits(D d, M bits, std::uint8_t* plane, std::size_t at) {
  if constexpr (hn::MaxLanes(D()) >= 8) {
    hn::StoreMaskBits(d, bits, plane + at / 8);
  } else {  // a processor without vectors
    std::array<std::uint8_t, kMaskSlack> few{};
    hn::StoreMaskBits(d, bits, few.data());
    const unsigned before = at % 8 == 0 ? 0 : plane[at / 8];
    plane[at / 8] = static_cast<std::uint8_t>(before | static_cast<unsigned>(few[0]) << (at % 8));
  }
}

/// Reads what store_bits() wrote.
template <class D>
HWY_INLINE hn::Mask<D> load_bits(D d, const std::uint8_t* plane, std::size_t at) {
  if constexpr (hn::MaxLanes(D()) >= 8) {
    return hn::LoadMaskBits(d, plane + at / 8);
  } else {
    std::array<std::uint8_t, kMaskSlack> few{};
    few[0] = static_cast<std::uint8_t>(plane[at / 8] >> (at % 8));
    return hn::LoadMaskBits(d, few.data());
  }
}

/// Writes the planes of a block. Returns the number of bits of its samples.
template <class Sample>
HWY_INLINE int pack_block(const std::uint8_t* samples, const std::uint8_t* above, int shift, std::uint8_t* out) {
  const SampleTag<Sample> d;
  alignas(64) std::array<Sample, kRowBlock> block;
  for (std::size_t i = 0; i < kRowBlock; i += hn::Lanes(d)) {
    auto own = load(d, samples, i), over = load(d, above, i);
    if constexpr (sizeof(Sample) == 2) {
      own = hn::ShiftRightSame(own, shift);
      over = hn::ShiftRightSame(over, shift);
    }
    hn::Store(folded(d, own, over), d, block.data() + i);
  }
  const int width = static_cast<int>(std::bit_width(any_of(block.data())));
  for (int k = 0; k < width; ++k) {
    const auto bit = hn::Set(d, static_cast<Sample>(1u << k));
    for (std::size_t i = 0; i < kRowBlock; i += hn::Lanes(d))
      store_bits(d, hn::TestBit(hn::Load(d, block.data() + i), bit), out, i);
    out += kPlaneBytes;
  }
  return width;
}

/// Makes the samples of a block from its planes, of which `planes` may be read a little beyond the end.
template <class Sample>
HWY_INLINE void unpack_block(const std::uint8_t* planes, int width, const std::uint8_t* above, int shift,
                             std::uint8_t* out) {
  const SampleTag<Sample> d;
  for (std::size_t i = 0; i < kRowBlock; i += hn::Lanes(d)) {
    auto value = hn::Zero(d);
    for (int k = 0; k < width; ++k) {
      const auto mask = load_bits(d, planes + static_cast<std::size_t>(k) * kPlaneBytes, i);
      value = hn::Or(value, hn::IfThenElseZero(mask, hn::Set(d, static_cast<Sample>(1u << k))));
    }
    const auto one = hn::Set(d, Sample{1});
    const auto sign = hn::Sub(hn::Zero(d), hn::And(value, one));
    auto over = load(d, above, i);
    if constexpr (sizeof(Sample) == 2) over = hn::ShiftRightSame(over, shift);
    auto sample = hn::Add(over, hn::Xor(hn::ShiftRight<1>(value), sign));
    if constexpr (sizeof(Sample) == 2) sample = hn::ShiftLeftSame(sample, shift);
    hn::StoreU(sample, d, reinterpret_cast<Sample*>(out + i * sizeof(Sample)));
  }
}

/// Writes all rows to `out`, which has room for them. Returns how many bytes that took.
template <class Sample>
std::size_t pack_all(const RowsView& view, std::uint8_t* out) {
  constexpr std::size_t kBlockBytes = kRowBlock * sizeof(Sample);
  const std::size_t blocks = blocks_of(view.stride, sizeof(Sample));
  std::uint8_t* const begin = out;
  for (std::size_t row = 0; row < view.rows; ++row) {
    const std::uint8_t* const own = view.samples + row * view.stride;
    const std::uint8_t* const above = row < view.colour_rows ? view.zeros : own - view.colour_rows * view.stride;
    std::uint8_t* const widths = out;
    std::memset(widths, 0, width_bytes(blocks, sizeof(Sample)));
    out += width_bytes(blocks, sizeof(Sample));
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::size_t at = block * kBlockBytes, left = view.stride - at;
      int width;
      if (left >= kBlockBytes) {
        width = pack_block<Sample>(own + at, above + at, view.shift, out);
      } else {
        std::array<std::uint8_t, kBlockBytes> last{}, over{};
        std::memcpy(last.data(), own + at, left);
        std::memcpy(over.data(), above + at, left);
        width = pack_block<Sample>(last.data(), over.data(), view.shift, out);
      }
      out += static_cast<std::size_t>(width) * kPlaneBytes;
      if constexpr (sizeof(Sample) == 1)
        widths[block / 2] = static_cast<std::uint8_t>(widths[block / 2] | width << (4 * (block % 2)));
      else
        widths[block] = static_cast<std::uint8_t>(width);
    }
  }
  return static_cast<std::size_t>(out - begin);
}

/// Makes all rows from `in`. Returns whether the bytes are exactly those of so many rows.
template <class Sample>
bool unpack_all(std::span<const std::uint8_t> in, const RowsView& view, std::uint8_t* samples) {
  constexpr std::size_t kBlockBytes = kRowBlock * sizeof(Sample), kMostWidth = 8 * sizeof(Sample);
  const std::size_t blocks = blocks_of(view.stride, sizeof(Sample)), head = width_bytes(blocks, sizeof(Sample));
  std::array<std::uint8_t, kMostWidth * kPlaneBytes + kMaskSlack> end_of_planes{};
  for (std::size_t row = 0; row < view.rows; ++row) {
    if (in.size() < head) return false;
    const std::uint8_t* const widths = in.data();
    in = in.subspan(head);
    std::uint8_t* const own = samples + row * view.stride;
    const std::uint8_t* const above = row < view.colour_rows ? view.zeros : own - view.colour_rows * view.stride;
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::size_t width = sizeof(Sample) == 1 ? widths[block / 2] >> (4 * (block % 2)) & 15 : widths[block];
      const std::size_t bytes = width * kPlaneBytes, at = block * kBlockBytes, left = view.stride - at;
      if (width > kMostWidth || in.size() < bytes) return false;
      const std::uint8_t* planes = in.data();
      if (in.size() < bytes + kMaskSlack) {
        std::copy_n(planes, bytes, end_of_planes.begin());
        planes = end_of_planes.data();
      }
      if (left >= kBlockBytes) {
        unpack_block<Sample>(planes, static_cast<int>(width), above + at, view.shift, own + at);
      } else {
        std::array<std::uint8_t, kBlockBytes> last{}, over{};
        std::memcpy(over.data(), above + at, left);
        unpack_block<Sample>(planes, static_cast<int>(width), over.data(), view.shift, last.data());
        std::memcpy(own + at, last.data(), left);
      }
      in = in.subspan(bytes);
    }
  }
  return in.empty();
}

std::size_t pack_bytes(const RowsView& view, std::uint8_t* out) { return pack_all<std::uint8_t>(view, out); }
std::size_t pack_words(const RowsView& view, std::uint8_t* out) { return pack_all<std::uint16_t>(view, out); }
bool unpack_bytes(std::span<const std::uint8_t> in, const RowsView& view, std::uint8_t* samples) {
  return unpack_all<std::uint8_t>(in, view, samples);
}
bool unpack_words(std::span<const std::uint8_t> in, const RowsView& view, std::uint8_t* samples) {
  return unpack_all<std::uint16_t>(in, view, samples);
}

/// Returns the bits that are set in any of the samples of two bytes, in `bytes` bytes.
std::uint16_t any_word(const std::uint8_t* samples, std::size_t bytes) {
  const hn::ScalableTag<std::uint16_t> d;
  const std::size_t lanes = hn::Lanes(d), words = bytes / 2;
  auto any = hn::Zero(d);
  std::size_t at = 0;
  for (; at + lanes <= words; at += lanes) any = hn::Or(any, load(d, samples, at));
  alignas(64) std::array<std::uint16_t, HWY_MAX_BYTES / 2> in_lanes{};
  hn::Store(any, d, in_lanes.data());
  unsigned out = 0;
  for (std::size_t i = 0; i < lanes; ++i) out |= in_lanes[i];
  for (; at < words; ++at) out |= static_cast<unsigned>(samples[2 * at] | samples[2 * at + 1] << 8);
  return static_cast<std::uint16_t>(out);
}

}  // namespace hueline::storage::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hueline::storage {
HWY_EXPORT(pack_bytes);
HWY_EXPORT(pack_words);
HWY_EXPORT(unpack_bytes);
HWY_EXPORT(unpack_words);
HWY_EXPORT(any_word);

namespace {

const std::uint8_t* octets(const std::byte* bytes) { return reinterpret_cast<const std::uint8_t*>(bytes); }
std::uint8_t* octets(std::byte* bytes) { return reinterpret_cast<std::uint8_t*>(bytes); }

Error malformed(const char* what) { return {ErrorCode::Malformed, std::string("a packed image ") + what}; }

}  // namespace

std::size_t packed_rows_bound(std::size_t payload_bytes, const PixelRows& rows) {
  if (!rows.fit(payload_bytes) || payload_bytes > kMostUnpacked) return 0;
  const std::size_t blocks = blocks_of(rows.stride, rows.sample_bytes);
  const std::size_t row = blocks * kRowBlock * rows.sample_bytes + width_bytes(blocks, rows.sample_bytes);
  return kPackedRowsHead + payload_bytes - std::size_t{rows.stride} * rows.rows + row * rows.rows + kMaskSlack;
}

std::size_t pack_rows(ByteView payload, const PixelRows& rows, std::span<std::byte> out) {
  const std::size_t bound = packed_rows_bound(payload.size(), rows);
  if (bound == 0 || out.size() < bound) return 0;
  const std::size_t image = std::size_t{rows.stride} * rows.rows, end = rows.offset + image;
  const std::vector<std::uint8_t> zeros(rows.stride);
  RowsView view{octets(payload.data() + rows.offset), zeros.data(), rows.stride, rows.rows, rows.colour_rows, 0};
  if (rows.sample_bytes == 2)
    if (const std::uint16_t any = HWY_DYNAMIC_DISPATCH(any_word)(view.samples, image); any != 0)
      view.shift = std::countr_zero(any);
  Bytes head;
  append(head, kPackedRowsVersion);
  append(head, rows.sample_bytes);
  append(head, rows.colour_rows);
  append(head, static_cast<std::uint8_t>(view.shift));
  append(head, rows.offset);
  append(head, rows.stride);
  append(head, rows.rows);
  append(head, static_cast<std::uint64_t>(payload.size()));
  auto at = std::copy(head.begin(), head.end(), out.begin());
  at = std::copy(payload.begin(), payload.begin() + rows.offset, at);
  at = std::copy(payload.begin() + static_cast<std::ptrdiff_t>(end), payload.end(), at);
  std::uint8_t* const packed = octets(&*at);
  const std::size_t size = static_cast<std::size_t>(at - out.begin()) +
                           (rows.sample_bytes == 1 ? HWY_DYNAMIC_DISPATCH(pack_bytes)(view, packed)
                                                   : HWY_DYNAMIC_DISPATCH(pack_words)(view, packed));
  return size < payload.size() ? size : 0;
}

Result<UnpackedRows> unpack_rows(ByteView packed) {
  ByteReader in(packed);
  UnpackedRows out;
  PixelRows& rows = out.rows;
  const auto version = in.take<std::uint8_t>();
  rows.sample_bytes = in.take<std::uint8_t>();
  rows.colour_rows = in.take<std::uint8_t>();
  const auto shift = in.take<std::uint8_t>();
  rows.offset = in.take<std::uint32_t>();
  rows.stride = in.take<std::uint32_t>();
  rows.rows = in.take<std::uint32_t>();
  const auto size = in.take<std::uint64_t>();
  if (!in.ok()) return malformed("is cut in its head");
  if (version != kPackedRowsVersion) return malformed("has another version than 1: a newer hueline reads it");
  // A block of no bits takes a half byte for 32 bytes, or a byte for 64.
  if (size > 64 * static_cast<std::uint64_t>(packed.size()) || size > kMostUnpacked)
    return malformed("says a size that it cannot have");
  if (!rows.fit(size) || shift >= 8 * rows.sample_bytes || (shift > 0 && rows.sample_bytes == 1))
    return malformed("has rows that do not fit in it");
  const std::size_t image = std::size_t{rows.stride} * rows.rows;
  const ByteView before = in.take_bytes(rows.offset), behind = in.take_bytes(size - rows.offset - image);
  if (!in.ok()) return malformed("is cut before its rows");
  MutableBuffer whole = MutableBuffer::of_size(size);
  std::copy(before.begin(), before.end(), whole.data());
  std::copy(behind.begin(), behind.end(), whole.data() + rows.offset + image);
  const std::vector<std::uint8_t> zeros(rows.stride);
  std::uint8_t* const samples = octets(whole.data() + rows.offset);
  const RowsView view{samples, zeros.data(), rows.stride, rows.rows, rows.colour_rows, shift};
  const ByteView planes = in.take_bytes(in.remaining());
  const std::span<const std::uint8_t> rest(octets(planes.data()), planes.size());
  const bool is_whole = rows.sample_bytes == 1 ? HWY_DYNAMIC_DISPATCH(unpack_bytes)(rest, view, samples)
                                               : HWY_DYNAMIC_DISPATCH(unpack_words)(rest, view, samples);
  if (!is_whole) return malformed("has rows that are cut or longer than they can be");
  out.payload = std::move(whole).share();
  return out;
}

}  // namespace hueline::storage
#endif
