// How the kernels of scanners write their returns with vector instructions. The files that include it are compiled once
// for each instruction set, and include it once for each.
#if defined(HUELINE_DRIVERS_WRITE_RETURNS) == defined(HWY_TARGET_TOGGLE)
#ifdef HUELINE_DRIVERS_WRITE_RETURNS
#undef HUELINE_DRIVERS_WRITE_RETURNS
#else
#define HUELINE_DRIVERS_WRITE_RETURNS
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numbers>

#include "core/measurements.hpp"

HWY_BEFORE_NAMESPACE();
namespace hueline::drivers::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Vectors of 4 to 16 lanes. On processors other than those of x86 they have 4, because there the number of lanes that
/// the processor has is not known to the compiler. Without vector instructions they have one.
#if HWY_TARGET == HWY_SCALAR
constexpr std::size_t kLanes = 1;
#elif HWY_ARCH_X86
constexpr std::size_t kLanes = HWY_MAX_BYTES / sizeof(float);
#else
constexpr std::size_t kLanes = 4;
#endif
using FloatTag = hn::FixedTag<float, kLanes>;
using IntTag = hn::FixedTag<std::int32_t, kLanes>;
using WordTag = hn::FixedTag<std::uint32_t, kLanes>;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;
using Words = hn::Vec<WordTag>;
using Chosen = hn::Mask<WordTag>;

static_assert(offsetof(LaserReturn, x) == 0 && offsetof(LaserReturn, y) == 4 && offsetof(LaserReturn, z) == 8 &&
              offsetof(LaserReturn, range_m) == 12 && offsetof(LaserReturn, azimuth) == 16 &&
              offsetof(LaserReturn, time_offset_ns) == 20 && offsetof(LaserReturn, channel) == 24 &&
              offsetof(LaserReturn, reflectivity) == 26 && offsetof(LaserReturn, return_number) == 27 &&
              offsetof(LaserReturn, return_count) == 28);

/// Returns the four bytes of LaserReturn that begin at `channel`.
constexpr std::uint32_t tags_of(std::uint32_t channel, std::uint32_t reflectivity, std::uint32_t return_number) {
  return channel | reflectivity << 16U | return_number << 24U;
}

/// Returns angles of [-2 pi, 4 pi) within [0, 2 pi), rad.
HWY_INLINE Floats in_circle(Floats angle) {
  const FloatTag d;
  const auto turn = hn::Set(d, static_cast<float>(2 * std::numbers::pi));
  const auto from_0 = hn::Add(angle, hn::IfThenElseZero(hn::Lt(angle, hn::Zero(d)), turn));
  return hn::Sub(from_0, hn::IfThenElseZero(hn::Ge(from_0, turn), turn));
}

#if HWY_TARGET == HWY_SCALAR

template <bool kIsBigEndian = false>
HWY_INLINE Words load_triples(const std::byte* firings, std::size_t = kLanes) {
  const auto words = hn::LoadU(WordTag(), reinterpret_cast<const std::uint32_t*>(firings));
  if (!kIsBigEndian) return words;
  const auto byte = [](std::uint32_t mask) { return hn::Set(WordTag(), mask); };
  const auto first = hn::ShiftLeft<8>(hn::And(words, byte(0xFF))),
             second = hn::And(hn::ShiftRight<8>(words), byte(0xFF));
  return hn::Or(hn::Or(first, second), hn::And(words, byte(0xFFFF0000U)));
}

HWY_INLINE LaserReturn* write_returns(Chosen is_kept, Words x, Words y, Words z, Words range, Words azimuth, Words time,
                                      Words tags, Words counts, LaserReturn* out) {
  const std::uint32_t words[8] = {hn::GetLane(x),       hn::GetLane(y),    hn::GetLane(z),    hn::GetLane(range),
                                  hn::GetLane(azimuth), hn::GetLane(time), hn::GetLane(tags), hn::GetLane(counts)};
  std::memcpy(static_cast<void*>(out), words, sizeof words);
  return out + hn::CountTrue(WordTag(), is_kept);
}

#else

/// Reads firings of three bytes each into the lower bytes of kLanes words; the upper byte of each is the next firing's.
/// The first two bytes of a firing are a number, big endian or little. Of `count` firings, a multiple of eight, at most
/// kLanes are read, and words behind them are 0. Reads up to four bytes beyond the last firing.
template <bool kIsBigEndian = false>
HWY_INLINE Words load_triples(const std::byte* firings, [[maybe_unused]] std::size_t count = kLanes) {
  alignas(16) constexpr std::uint8_t kLittle[16] = {0, 1, 2, 3, 3, 4, 5, 6, 6, 7, 8, 9, 9, 10, 11, 12};
  alignas(16) constexpr std::uint8_t kBig[16] = {1, 0, 2, 3, 4, 3, 5, 6, 7, 6, 8, 9, 10, 9, 11, 12};
#if HWY_ARCH_X86 && HWY_MAX_BYTES == 64
  // Four firings, which are three words, to each block of 128 bits.
  const WordTag d;
  const hn::Repartition<std::uint8_t, WordTag> bytes;
  alignas(64) constexpr std::uint32_t kThirds[16] = {0, 1, 2, 3, 3, 4, 5, 6, 6, 7, 8, 9, 9, 10, 11, 12};
  const auto is_word = hn::FirstN(d, count < kLanes ? count / 4 * 3 : 12);
  const auto words = hn::MaskedLoad(is_word, d, reinterpret_cast<const std::uint32_t*>(firings));
  const auto blocks = hn::TableLookupLanes(words, hn::IndicesFromVec(d, hn::Load(d, kThirds)));
  const auto places = hn::LoadDup128(bytes, kIsBigEndian ? kBig : kLittle);
  return hn::BitCast(d, hn::TableLookupBytes(hn::BitCast(bytes, blocks), places));
#else
  const hn::FixedTag<std::uint8_t, 16> block;
  const auto places = hn::Load(block, kIsBigEndian ? kBig : kLittle);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(firings);
  const auto four = [&](std::size_t i) { return hn::TableLookupBytes(hn::LoadU(block, bytes + 12 * i), places); };
#if HWY_ARCH_X86 && HWY_MAX_BYTES == 32
  const hn::FixedTag<std::uint8_t, 32> two;
  return hn::BitCast(WordTag(), hn::Combine(two, four(1), four(0)));
#else
  return hn::BitCast(WordTag(), four(0));
#endif
#endif
}

#if HWY_ARCH_X86 && HWY_MAX_BYTES == 64

/// Takes lanes of two vectors: numbers of 0 to 15 are of the first, of 16 to 31 of the second.
HWY_INLINE Words lanes_of(Words first, Words second, Words numbers) {
  return Words{_mm512_permutex2var_epi32(first.raw, numbers.raw, second.raw)};
}

/// Writes eight returns, those of the pairs of lanes that `numbers` names in the order 0 2 1 3 4 6 5 7: lane k of the
/// first quantity of a pair is number k, of the second one 16 + k.
HWY_INLINE void write_eight(Words numbers, Words x, Words y, Words z, Words range, Words azimuth, Words time,
                            Words tags, Words counts, LaserReturn* out) {
  const hn::FixedTag<std::uint64_t, kLanes / 2> d;
  const auto pairs = [&](Words a, Words b) { return hn::BitCast(d, lanes_of(a, b, numbers)); };
  const auto xy = pairs(x, y), zr = pairs(z, range), at = pairs(azimuth, time), tc = pairs(tags, counts);
  const auto write_four = [&](auto first_halves, auto second_halves, LaserReturn* to) {
    const auto write_two = [&](__m512i places, LaserReturn* two) {
      _mm512_storeu_si512(two, _mm512_permutex2var_epi64(first_halves.raw, places, second_halves.raw));
    };
    write_two(_mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11), to);
    write_two(_mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15), to + 4);
  };
  write_four(hn::InterleaveLower(d, xy, zr), hn::InterleaveLower(d, at, tc), out);
  write_four(hn::InterleaveUpper(d, xy, zr), hn::InterleaveUpper(d, at, tc), out + 2);
}

/// Writes the returns of the lanes that `order` names.
HWY_INLINE void write_lanes(Words order, Words x, Words y, Words z, Words range, Words azimuth, Words time, Words tags,
                            Words counts, LaserReturn* out) {
  const WordTag d;
  alignas(64) constexpr std::uint32_t kPairs[2][16] = {{0, 0, 2, 2, 1, 1, 3, 3, 4, 4, 6, 6, 5, 5, 7, 7},
                                                       {8, 8, 10, 10, 9, 9, 11, 11, 12, 12, 14, 14, 13, 13, 15, 15}};
  const auto seconds = hn::BitCast(d, hn::Set(hn::FixedTag<std::uint64_t, kLanes / 2>(), std::uint64_t{16} << 32U));
  for (std::size_t half = 0; half < 2; ++half) {
    const auto lanes = hn::TableLookupLanes(order, hn::IndicesFromVec(d, hn::Load(d, kPairs[half])));
    write_eight(hn::Or(lanes, seconds), x, y, z, range, azimuth, time, tags, counts, out + 8 * half);
  }
}

HWY_INLINE LaserReturn* write_returns(Chosen is_kept, Words x, Words y, Words z, Words range, Words azimuth, Words time,
                                      Words tags, Words counts, LaserReturn* out) {
  const WordTag d;
  write_lanes(hn::Compress(hn::Iota(d, 0), is_kept), x, y, z, range, azimuth, time, tags, counts, out);
  return out + hn::CountTrue(d, is_kept);
}

#else

/// Writes returns, each over the one before if that one is not kept, as the bits of `kept` say. Block b of 128 bits of
/// the first four vectors has the first halves of returns 4 b to 4 b + 3, that of the others the second halves.
template <class D, class V>
HWY_INLINE LaserReturn* write_halves(D d, std::uint32_t kept, V p0, V p1, V p2, V p3, V q0, V q1, V q2, V q3,
                                     LaserReturn* out) {
  const auto store = [&](V v, std::size_t at) { hn::StoreU(v, d, reinterpret_cast<std::uint8_t*>(out) + at); };
  const auto advance = [&] {
    out += kept & 1U;
    kept >>= 1U;
  };
#if HWY_ARCH_X86 && HWY_MAX_BYTES >= 32
  const auto write_lower = [&](V p, V q) { store(hn::ConcatLowerLower(d, q, p), 0), advance(); };
  const auto write_upper = [&](V p, V q) { store(hn::ConcatUpperUpper(d, q, p), 0), advance(); };
  write_lower(p0, q0), write_lower(p1, q1), write_lower(p2, q2), write_lower(p3, q3);
  write_upper(p0, q0), write_upper(p1, q1), write_upper(p2, q2), write_upper(p3, q3);
#else
  const auto write = [&](V p, V q) { store(p, 0), store(q, 16), advance(); };
  write(p0, q0), write(p1, q1), write(p2, q2), write(p3, q3);
#endif
  return out;
}

/// Writes those of kLanes returns that are kept to `out`, and returns the end. There must be room for kWrittenAhead
/// more returns than are kept, because returns are written before it is known whether they are kept: whether they are,
/// is nearly random, and a wrong prediction of a branch costs more than the store. `tags` are the four bytes of
/// LaserReturn from `channel` on, `counts` the four behind them. The bits of floats are given as words.
HWY_INLINE LaserReturn* write_returns(Chosen is_kept, Words x, Words y, Words z, Words range, Words azimuth, Words time,
                                      Words tags, Words counts, LaserReturn* out) {
  const WordTag d;
  const hn::FixedTag<std::uint64_t, kLanes / 2> pairs;
  const hn::FixedTag<std::uint8_t, 4 * kLanes> bytes;
  const auto lower = [&](auto a, auto b) { return hn::BitCast(pairs, hn::InterleaveLower(d, a, b)); };
  const auto upper = [&](auto a, auto b) { return hn::BitCast(pairs, hn::InterleaveUpper(d, a, b)); };
  // Four vectors of one quantity each become four of the four quantities of one return a block.
  const auto xy_low = lower(x, y), xy_high = upper(x, y), zr_low = lower(z, range), zr_high = upper(z, range);
  const auto at_low = lower(azimuth, time), at_high = upper(azimuth, time), tc_low = lower(tags, counts),
             tc_high = upper(tags, counts);
  const auto lower_pair = [&](auto a, auto b) { return hn::BitCast(bytes, hn::InterleaveLower(pairs, a, b)); };
  const auto upper_pair = [&](auto a, auto b) { return hn::BitCast(bytes, hn::InterleaveUpper(pairs, a, b)); };
  std::uint8_t mask_bits[8] = {};
  hn::StoreMaskBits(d, is_kept, mask_bits);
  std::uint32_t kept_bits;
  std::memcpy(&kept_bits, mask_bits, sizeof kept_bits);
  return write_halves(bytes, kept_bits, lower_pair(xy_low, zr_low), upper_pair(xy_low, zr_low),
                      lower_pair(xy_high, zr_high), upper_pair(xy_high, zr_high), lower_pair(at_low, tc_low),
                      upper_pair(at_low, tc_low), lower_pair(at_high, tc_high), upper_pair(at_high, tc_high), out);
}

#endif
#endif

/// What write_returns() takes, in memory: each quantity of kLanes returns, and whether they are kept.
struct Lanes {
  alignas(64) std::uint32_t words[9][kLanes];

  HWY_INLINE void store(Chosen is_kept, Words x, Words y, Words z, Words range, Words azimuth, Words time, Words tags,
                        Words counts) {
    std::size_t i = 0;
    const auto add = [&](auto quantity) { hn::Store(quantity, WordTag(), words[i++]); };
    add(x), add(y), add(z), add(range), add(azimuth), add(time), add(tags), add(counts);
    add(hn::VecFromMask(WordTag(), is_kept));
  }
};

#if HWY_ARCH_X86 && HWY_MAX_BYTES == 64

/// For each place of the returns of kLanes firings, firing by firing, the number of the return among those of `lanes`.
template <std::size_t kReturns>
struct InTurn {
  alignas(64) std::uint32_t numbers[kReturns][kLanes];
  constexpr InTurn() : numbers() {
    for (std::uint32_t k = 0; k < kReturns * kLanes; ++k)
      numbers[k / kLanes][k % kLanes] = k % kReturns * kLanes + k / kReturns;
  }
};
template <std::size_t kReturns>
constexpr InTurn<kReturns> kInTurn;

template <std::size_t kReturns>
HWY_INLINE LaserReturn* write_in_turn(const Lanes (&lanes)[kReturns], LaserReturn* out) {
  static_assert(kReturns == 2 || kReturns == 3);
  const WordTag d;
  const auto take = [&](std::size_t i, Words numbers) {
    const auto of = [&](std::size_t which) { return hn::Load(d, lanes[which].words[i]); };
    const auto two = lanes_of(of(0), of(1), numbers);
    if constexpr (kReturns == 2) {
      return two;
    } else {
      const auto third = lanes_of(of(2), of(2), numbers);
      return hn::IfThenElse(hn::Gt(numbers, hn::Set(d, 2 * kLanes - 1)), third, two);
    }
  };
  std::uint32_t kept[(kReturns + 1) * kLanes];
  std::size_t count = 0;
  for (std::size_t k = 0; k < kReturns; ++k) {
    const auto numbers = hn::Load(d, kInTurn<kReturns>.numbers[k]);
    const auto is_kept = hn::MaskFromVec(take(8, numbers));
    hn::StoreU(hn::Compress(numbers, is_kept), d, kept + count);
    count += hn::CountTrue(d, is_kept);
  }
  for (std::size_t at = 0; at < count; at += kLanes) {
    const auto numbers = hn::LoadU(d, kept + at);
    write_lanes(hn::Iota(d, 0), take(0, numbers), take(1, numbers), take(2, numbers), take(3, numbers),
                take(4, numbers), take(5, numbers), take(6, numbers), take(7, numbers), out + at);
  }
  return out + count;
}

#else

/// Does the same as write_returns() for firings with several returns, which are written firing by firing.
template <std::size_t kReturns>
HWY_INLINE LaserReturn* write_in_turn(const Lanes (&lanes)[kReturns], LaserReturn* out) {
  static_assert(kReturns == 2 || kReturns == 3);
  const WordTag d;
  alignas(64) std::uint32_t words[9][kReturns * kLanes];
  for (std::size_t i = 0; i < 9; ++i) {
    const auto of = [&](std::size_t which) { return hn::Load(d, lanes[which].words[i]); };
    if constexpr (kReturns == 2)
      hn::StoreInterleaved2(of(0), of(1), d, words[i]);
    else
      hn::StoreInterleaved3(of(0), of(1), of(2), d, words[i]);
  }
  for (std::size_t k = 0; k < kReturns * kLanes; k += kLanes) {
    const auto quantity = [&](std::size_t i) { return hn::Load(d, words[i] + k); };
    out = write_returns(hn::MaskFromVec(quantity(8)), quantity(0), quantity(1), quantity(2), quantity(3), quantity(4),
                        quantity(5), quantity(6), quantity(7), out);
  }
  return out;
}

#endif

}  // namespace hueline::drivers::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
