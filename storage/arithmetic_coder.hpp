#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "storage/byte_order.hpp"

/// The arithmetic coder of LAZ files: adaptive models, an encoder and a decoder. Source: A. Said, "Introduction to
/// Arithmetic Coding - Theory and Practice", HP Labs report HPL-2004-76, with the constants of the published LASzip
/// format (M. Isenburg, "LASzip: lossless compression of LiDAR data", 2013).
///
/// Encoder and decoder have the same functions, so that what uses them is written once for both directions: code()
/// takes a value and returns it. The encoder writes the value that it is given. The decoder does not look at that value
/// and returns the one that it reads.
namespace hueline::storage {

/// The probabilities of the symbols 0 to n - 1, learned from those that were coded. n is from 2 to 2048.
/// Thread safety: none.
class SymbolModel {
 public:
  explicit SymbolModel(std::uint32_t symbols);

 private:
  friend class ArithmeticEncoder;
  friend class ArithmeticDecoder;
  void count(std::uint32_t symbol) {
    ++counts_[symbol];
    if (--until_update_ == 0) update();
  }
  void update();

  std::uint32_t last_;                 // the greatest symbol
  std::vector<std::uint32_t> sums_;    // probability of all smaller symbols, in units of 1 / 2^15
  std::vector<std::uint32_t> counts_;  // how often each symbol came
  std::uint32_t total_, cycle_, until_update_;
};

/// The same for the two symbols of a bit.
class BitModel {
 private:
  friend class ArithmeticEncoder;
  friend class ArithmeticDecoder;
  void count(std::uint32_t bit) {
    zeros_ += bit ^ 1u;
    if (--until_update_ == 0) update();
  }
  void update();

  std::uint32_t zero_probability_ = 1u << 12;  // in units of 1 / 2^13
  std::uint32_t zeros_ = 1, total_ = 2, cycle_ = 4, until_update_ = 4;
};

/// Writes symbols. Thread safety: none.
class ArithmeticEncoder {
 public:
  static constexpr bool kDecodes = false;

  std::uint32_t code(SymbolModel& model, std::uint32_t symbol) {
    const std::uint32_t unit = length_ >> 15;
    const std::uint32_t low = model.sums_[symbol] * unit;
    length_ = symbol == model.last_ ? length_ - low : model.sums_[symbol + 1] * unit - low;
    advance(low);
    model.count(symbol);
    return symbol;
  }
  std::uint32_t code(BitModel& model, std::uint32_t bit) {
    const std::uint32_t zero = model.zero_probability_ * (length_ >> 13);
    if (bit) {
      length_ -= zero;
      advance(zero);
    } else {
      length_ = zero;
      advance(0);
    }
    model.count(bit);
    return bit;
  }
  /// Codes the lowest `bits` bits of `value`, which are from 1 to 32, as they are.
  std::uint32_t code_bits(std::uint32_t bits, std::uint32_t value) {
    std::uint32_t rest = value;
    if (bits > 19) {
      length_ >>= 16;
      advance((rest & 0xFFFF) * length_);
      rest >>= 16;
      bits -= 16;
    }
    length_ >>= bits;
    advance(rest * length_);
    return value;
  }
  /// Writes what is left and returns all bytes. The encoder must not be used after that.
  Bytes finish();

 private:
  void advance(std::uint32_t low) {
    base_ += low;
    if (base_ < low) carry();
    while (length_ < 1u << 24) {
      if (size_ == bytes_.size()) grow();
      bytes_[size_++] = static_cast<std::byte>(base_ >> 24);
      base_ <<= 8;
      length_ <<= 8;
    }
  }
  void carry();
  void grow();

  std::uint32_t base_ = 0, length_ = 0xFFFFFFFF;
  std::size_t size_ = 0;
  Bytes bytes_;
};

/// Reads symbols from bytes that an encoder wrote. Bytes behind the end are read as 0, so damaged bytes give wrong
/// symbols, but always symbols that the model has. Thread safety: none.
class ArithmeticDecoder {
 public:
  static constexpr bool kDecodes = true;

  explicit ArithmeticDecoder(ByteView bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) value_ = value_ << 8 | next();
  }
  std::uint32_t code(SymbolModel& model, std::uint32_t = 0);
  std::uint32_t code(BitModel& model, std::uint32_t = 0);
  std::uint32_t code_bits(std::uint32_t bits, std::uint32_t = 0);
  /// Returns whether it had to read behind the end of the bytes, which therefore were cut or are damaged.
  bool passed_end() const { return passed_end_; }
  /// Returns how many bytes it has read: after the last symbol, all that the encoder wrote.
  std::size_t used() const { return at_; }

 private:
  std::uint32_t next() {
    if (at_ < bytes_.size()) return std::to_integer<std::uint32_t>(bytes_[at_++]);
    passed_end_ = true;
    return 0;
  }
  void advance(std::uint32_t low) {
    value_ -= low;
    while (length_ < 1u << 24) {
      value_ = value_ << 8 | next();
      length_ <<= 8;
    }
  }

  ByteView bytes_;
  std::size_t at_ = 0;
  bool passed_end_ = false;
  std::uint32_t value_ = 0, length_ = 0xFFFFFFFF;
};

/// Codes integers as the difference to a prediction: first the number of bits of the difference, then the difference
/// itself, of which the highest 8 bits are modelled. Thread safety: none.
class IntegerModel {
 public:
  /// `bits`: 16 for values that wrap at 2^16, otherwise 32. Each context has its own model of the number of bits.
  IntegerModel(int bits, std::size_t contexts);

  template <class Coder>
  std::int32_t code(Coder& coder, std::int32_t prediction, std::int32_t value, std::size_t context) {
    const std::int32_t difference = code_difference(
        coder, wrap(static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(prediction)), context);
    if constexpr (!Coder::kDecodes) return value;
    return wrap(static_cast<std::uint32_t>(prediction) + static_cast<std::uint32_t>(difference));
  }
  /// The number of bits of the difference that was coded last, from 0 to 32.
  std::uint32_t width() const { return width_; }

 private:
  std::int32_t wrap(std::uint32_t value) const {
    return bits_ == 16 ? static_cast<std::int16_t>(value) : static_cast<std::int32_t>(value);
  }
  template <class Coder>
  std::int32_t code_difference(Coder& coder, std::int32_t difference, std::size_t context) {
    // The width k is that of the least interval [-(2^k - 1), 2^k] that holds the difference.
    const auto given = static_cast<std::uint32_t>(difference);
    width_ = coder.code(widths_[context],
                        static_cast<std::uint32_t>(std::bit_width(difference <= 0 ? 0 - given : given - 1)));
    if (width_ == 0) return static_cast<std::int32_t>(coder.code(zero_or_one_, given & 1));
    if (width_ == 32) return INT32_MIN;
    // The numbers of width k that are not of width k - 1, as 0 to 2^k - 1.
    const std::uint32_t all = (1u << width_) - 1;
    std::uint32_t number = difference < 0 ? given + all : given - 1;
    if (width_ <= kModelledBits) {
      number = coder.code(numbers_[width_ - 1], number);
    } else {
      const std::uint32_t low_bits = width_ - kModelledBits;
      const std::uint32_t high = coder.code(numbers_[width_ - 1], number >> low_bits);
      number = high << low_bits | coder.code_bits(low_bits, number & ((1u << low_bits) - 1));
    }
    return static_cast<std::int32_t>(number >> (width_ - 1) ? number + 1 : number - all);
  }

  static constexpr std::uint32_t kModelledBits = 8;
  int bits_;
  std::uint32_t width_ = 0;
  std::vector<SymbolModel> widths_, numbers_;
  BitModel zero_or_one_;
};

}  // namespace hueline::storage
