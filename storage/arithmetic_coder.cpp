#include "storage/arithmetic_coder.hpp"

#include <algorithm>
#include <utility>

namespace hueline::storage {
namespace {

constexpr std::uint32_t kMostSymbols = 1u << 15;  // counts are halved when their sum exceeds this
constexpr std::uint32_t kMostBits = 1u << 13;

}  // namespace

SymbolModel::SymbolModel(std::uint32_t symbols)
    : last_(symbols - 1), sums_(symbols), counts_(symbols, 1), total_(0), cycle_(symbols) {
  update();
  until_update_ = cycle_ = (symbols + 6) >> 1;
}

void SymbolModel::update() {
  total_ += cycle_;
  if (total_ > kMostSymbols) {
    total_ = 0;
    for (std::uint32_t& count : counts_) total_ += count = (count + 1) >> 1;
  }
  const std::uint32_t scale = (1u << 31) / total_;
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    sums_[i] = scale * sum >> 16;
    sum += counts_[i];
  }
  cycle_ = std::min(5 * cycle_ >> 2, (last_ + 7) << 3);
  until_update_ = cycle_;
}

void BitModel::update() {
  total_ += cycle_;
  if (total_ > kMostBits) {
    total_ = (total_ + 1) >> 1;
    zeros_ = (zeros_ + 1) >> 1;
    if (zeros_ == total_) ++total_;
  }
  zero_probability_ = zeros_ * ((1u << 31) / total_) >> 18;
  cycle_ = std::min(5 * cycle_ >> 2, 64u);
  until_update_ = cycle_;
}

void ArithmeticEncoder::carry() {
  std::size_t i = size_;
  while (bytes_[--i] == std::byte{0xFF}) bytes_[i] = std::byte{0};
  bytes_[i] = static_cast<std::byte>(std::to_integer<unsigned>(bytes_[i]) + 1);
}

void ArithmeticEncoder::grow() { bytes_.resize(std::max<std::size_t>(4096, 2 * bytes_.size())); }

Bytes ArithmeticEncoder::finish() {
  // The shortest number inside the interval ends the code. The zeros behind it are what a decoder reads ahead.
  const bool is_wide = length_ > 1u << 25;
  length_ = is_wide ? 1u << 23 : 1u << 15;
  advance(is_wide ? 1u << 24 : 1u << 23);
  bytes_.resize(size_);
  bytes_.insert(bytes_.end(), is_wide ? 3 : 2, std::byte{0});
  return std::move(bytes_);
}

std::uint32_t ArithmeticDecoder::code(SymbolModel& model, std::uint32_t) {
  const std::uint32_t unit = length_ >> 15;
  const auto above = std::upper_bound(model.sums_.begin() + 1, model.sums_.end(), value_ / unit);
  const auto symbol = static_cast<std::uint32_t>(above - model.sums_.begin()) - 1;
  const std::uint32_t low = model.sums_[symbol] * unit;
  length_ = symbol == model.last_ ? length_ - low : model.sums_[symbol + 1] * unit - low;
  advance(low);
  model.count(symbol);
  return symbol;
}

std::uint32_t ArithmeticDecoder::code(BitModel& model, std::uint32_t) {
  const std::uint32_t zero = model.zero_probability_ * (length_ >> 13);
  const std::uint32_t bit = value_ >= zero;
  length_ = bit ? length_ - zero : zero;
  advance(bit ? zero : 0);
  model.count(bit);
  return bit;
}

std::uint32_t ArithmeticDecoder::code_bits(std::uint32_t bits, std::uint32_t) {
  std::uint32_t low = 0, low_bits = 0;
  if (bits > 19) {
    low = code_bits(16);
    low_bits = 16;
    bits -= 16;
  }
  length_ >>= bits;
  const std::uint32_t value = std::min(value_ / length_, (1u << bits) - 1);
  advance(value * length_);
  return value << low_bits | low;
}

IntegerModel::IntegerModel(int bits, std::size_t contexts)
    : bits_(bits), widths_(contexts, SymbolModel(static_cast<std::uint32_t>(bits) + 1)) {
  numbers_.reserve(static_cast<std::size_t>(bits));
  for (std::uint32_t width = 1; width <= static_cast<std::uint32_t>(bits); ++width)
    numbers_.emplace_back(1u << std::min(width, kModelledBits));
}

}  // namespace hueline::storage
