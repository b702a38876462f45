#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Check sums of messages that may overlap in a broken stream.
namespace hueline::drivers {

/// Computes a check sum of ranges of one stream that may overlap. No byte is hashed more than twice, however far the
/// ranges overlap. That bounds the work for garbage that looks like thousands of headers, each of which claims the same
/// kilobytes. (novatel/OverlappingCrc does the same with the fast CRC-32 of a library.)
///
/// `Hash` is a check sum whose value for a range follows from its states at both ends of the range:
///
///   State                          what a prefix of the stream leaves behind; State{} before its first byte
///   next(State, byte, position)    the state one byte later; `position` is that of the byte in the stream
///   between(begin, end, position, bytes)   the check sum of `bytes` bytes that begin at `position`
///
/// Thread safety: none; one thread calls all functions.
template <class Hash>
class OverlappingHash {
 public:
  /// Returns the check sum of `bytes`, which begin at `position` of the stream. `position` must not be smaller than in
  /// the call before.
  auto of(std::span<const std::byte> bytes, std::uint64_t position) {
    const std::uint64_t end = position + bytes.size();
    if (position >= hashed_to_) {
      hashed_to_ = end;
      prefixes_.clear();
      typename Hash::State state{};
      for (std::uint64_t at = position; at < end; ++at) state = step(state, bytes[at - position], at);
      return Hash::between({}, state, position, bytes.size());
    }
    hashed_to_ = std::max(hashed_to_, end);
    if (prefixes_.empty() || position >= first_ + prefixes_.size()) {
      first_ = position;
      prefixes_.assign(1, {});
    }
    // Earlier prefixes are not needed again. They are removed only when they are more than half, so that moving the
    // rest costs little for each byte.
    if (const std::size_t unused = position - first_; unused > prefixes_.size() / 2) {
      prefixes_.erase(prefixes_.begin(), prefixes_.begin() + static_cast<std::ptrdiff_t>(unused));
      first_ = position;
    }
    for (std::uint64_t at = first_ + prefixes_.size() - 1; at < end; ++at)
      prefixes_.push_back(step(prefixes_.back(), bytes[at - position], at));
    return Hash::between(prefixes_[position - first_], prefixes_[end - first_], position, bytes.size());
  }

  /// Returns the number of bytes hashed so far.
  std::uint64_t bytes_hashed() const { return bytes_hashed_; }

 private:
  typename Hash::State step(typename Hash::State state, std::byte byte, std::uint64_t position) {
    ++bytes_hashed_;
    return Hash::next(state, static_cast<std::uint8_t>(byte), position);
  }

  std::uint64_t hashed_to_ = 0;                 // end of the range that reaches farthest
  std::uint64_t first_ = 0;                     // stream position of prefixes_[0]
  std::vector<typename Hash::State> prefixes_;  // [k]: the state of the stretch up to first_ + k
  std::uint64_t bytes_hashed_ = 0;
};

/// The sum of the bytes, and the sum of all its intermediate values (Fletcher's check sum modulo 256). The value is
/// the first sum + 256 x the second: the two bytes of UBX, little endian.
struct FletcherHash {
  struct State {
    std::uint32_t sum = 0, sum_of_sums = 0;
  };
  static State next(State state, std::uint8_t byte, std::uint64_t) {
    state.sum += byte;
    state.sum_of_sums += state.sum;
    return state;
  }
  static std::uint16_t between(State begin, State end, std::uint64_t, std::size_t bytes) {
    const std::uint32_t first = end.sum - begin.sum;
    const std::uint32_t second = end.sum_of_sums - begin.sum_of_sums - static_cast<std::uint32_t>(bytes) * begin.sum;
    return static_cast<std::uint16_t>((first & 0xFF) | (second & 0xFF) << 8);
  }
};

/// The sum of the bytes modulo 256.
struct SumHash {
  using State = std::uint8_t;
  static State next(State state, std::uint8_t byte, std::uint64_t) { return static_cast<State>(state + byte); }
  static std::uint8_t between(State begin, State end, std::uint64_t, std::size_t) {
    return static_cast<std::uint8_t>(end - begin);
  }
};

/// The sum of the little-endian 16-bit words modulo 65536. The number of bytes must be even.
struct WordSumHash {
  struct State {
    std::array<std::uint16_t, 2> sums{};  // of the bytes at even and at odd positions of the stream
  };
  static State next(State state, std::uint8_t byte, std::uint64_t position) {
    state.sums[position % 2] = static_cast<std::uint16_t>(state.sums[position % 2] + byte);
    return state;
  }
  static std::uint16_t between(State begin, State end, std::uint64_t position, std::size_t) {
    const std::size_t low = position % 2, high = 1 - low;
    return static_cast<std::uint16_t>((end.sums[low] - begin.sums[low]) + ((end.sums[high] - begin.sums[high]) << 8));
  }
};

/// A CRC of `kBits` bits whose register starts at 0 and takes the highest bit first, such as CRC-16/CCITT (0x1021) and
/// Qualcomm's CRC-24 (0x864CFB).
template <std::uint32_t kPolynomial, int kBits>
struct CrcHash {
  using State = std::uint32_t;
  static constexpr std::uint32_t kMask = static_cast<std::uint32_t>((std::uint64_t{1} << kBits) - 1);
  static constexpr std::uint32_t kTop = std::uint32_t{1} << (kBits - 1);

  static constexpr std::uint32_t doubled(std::uint32_t a) {
    return ((a << 1) & kMask) ^ ((a & kTop) != 0 ? kPolynomial : 0);
  }
  static constexpr std::array<std::uint32_t, 256> kStep = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t crc = i << (kBits - 8);
      for (int bit = 0; bit < 8; ++bit) crc = doubled(crc);
      table[i] = crc;
    }
    return table;
  }();
  /// Returns a * b modulo the polynomial.
  static constexpr std::uint32_t multiply(std::uint32_t a, std::uint32_t b) {
    std::uint32_t product = 0;
    for (int bit = kBits - 1; bit >= 0; --bit) {
      product = doubled(product);
      if (((b >> bit) & 1) != 0) product ^= a;
    }
    return product;
  }
  static State next(State state, std::uint8_t byte, std::uint64_t) {
    return ((state << 8) & kMask) ^ kStep[((state >> (kBits - 8)) ^ byte) & 0xFF];
  }
  static std::uint32_t between(State begin, State end, std::uint64_t, std::size_t bytes) {
    // The register is linear: `bytes` zero bytes multiply it by x^(8 bytes).
    std::uint32_t power = 1u << 8, factor = 1;
    for (std::size_t n = begin == 0 ? 0 : bytes; n > 0; n /= 2, power = multiply(power, power))
      if (n % 2 == 1) factor = multiply(factor, power);
    return end ^ multiply(begin, factor);
  }
};
using Crc16Hash = CrcHash<0x1021, 16>;
using Crc24Hash = CrcHash<0x864CFB, 24>;

}  // namespace hueline::drivers
