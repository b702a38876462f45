#include "drivers/can/can_signal.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hueline::drivers {
namespace {

std::uint8_t crc8(std::uint8_t polynomial, std::span<const std::uint8_t> data, std::size_t without) {
  std::uint8_t crc = 0xFF;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (i == without) continue;
    crc = static_cast<std::uint8_t>(crc ^ data[i]);
    for (int bit = 0; bit < 8; ++bit) crc = static_cast<std::uint8_t>(crc & 0x80 ? (crc << 1) ^ polynomial : crc << 1);
  }
  return static_cast<std::uint8_t>(crc ^ 0xFF);
}

}  // namespace

std::size_t CanSignal::needed_bytes() const {
  if (order == BitOrder::Little) return static_cast<std::size_t>((start_bit + bits + 7) / 8);
  const int in_first = start_bit % 8 + 1;
  return static_cast<std::size_t>(start_bit / 8 + 1 + (bits > in_first ? (bits - in_first + 7) / 8 : 0));
}

std::string CanSignal::validate(std::size_t data_bytes) const {
  if (bits < 1 || bits > 64) return fmt::format("bits: {} is not within 1 .. 64", bits);
  if (start_bit < 0 || start_bit > 511) return fmt::format("start_bit: {} is not within 0 .. 511", start_bit);
  if (needed_bytes() > data_bytes)
    return fmt::format("start_bit: {} bits from {} on do not fit into {} bytes", bits, start_bit, data_bytes);
  if (!std::isfinite(scale) || scale == 0) return "scale must be a number other than 0";
  if (!std::isfinite(offset)) return "offset must be a number";
  if (!(min <= max)) return fmt::format("min: {} is above max {}", min, max);
  return {};
}

std::int64_t CanSignal::raw(std::span<const std::uint8_t> data) const {
  std::uint64_t value = 0;
  if (order == BitOrder::Little) {
    for (int i = bits - 1; i >= 0; --i) {
      const int bit = start_bit + i;
      value = value << 1 | (data[static_cast<std::size_t>(bit / 8)] >> (bit % 8) & 1U);
    }
  } else {
    // From the most significant bit down; behind bit 0 of a byte comes bit 7 of the next.
    for (int i = 0, bit = start_bit; i < bits; ++i) {
      value = value << 1 | (data[static_cast<std::size_t>(bit / 8)] >> (bit % 8) & 1U);
      bit = bit % 8 == 0 ? bit + 15 : bit - 1;
    }
  }
  if (is_signed && bits < 64 && (value >> (bits - 1) & 1U) != 0) value |= ~std::uint64_t{0} << bits;
  return static_cast<std::int64_t>(value);
}

double CanSignal::value(std::span<const std::uint8_t> data) const {
  const std::int64_t bare = raw(data);
  const double number = is_signed ? static_cast<double>(bare) : static_cast<double>(static_cast<std::uint64_t>(bare));
  return number * scale + offset;
}

CounterRange counter_range(const CanSignal& counter) {
  if (counter.max > counter.min)
    return {std::llround(counter.min), std::llround(counter.max) - std::llround(counter.min) + 1};
  return {0, std::int64_t{1} << counter.bits};
}

std::uint8_t can_checksum(CanChecksum kind, std::span<const std::uint8_t> data, std::size_t without_byte) {
  switch (kind) {
    case CanChecksum::Crc8J1850:
      return crc8(0x1D, data, without_byte);
    case CanChecksum::Crc8H2f:
      return crc8(0x2F, data, without_byte);
    case CanChecksum::Xor:
      break;
  }
  std::uint8_t sum = 0;
  for (std::size_t i = 0; i < data.size(); ++i)
    if (i != without_byte) sum = static_cast<std::uint8_t>(sum ^ data[i]);
  return sum;
}

}  // namespace hueline::drivers
