#include "drivers/can/can_signal.hpp"

#include <fmt/format.h>

#include <bit>
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

void CanSignal::visit(Keys& keys) {
  keys.whole({"start_bit", "",
              "The first bit as DBC files count: bit 8 i + k is bit k of byte i. It is the least significant bit of "
              "the signal, with `byte_order: big` the most "
              "significant one.",
              "-"},
             start_bit, {0, 511});
  keys.whole({"bits", "", "How many bits the signal has.", "-"}, bits, {1, 64});
  keys.choice({"byte_order", "", "`little` is what DBC files call Intel, `big` is Motorola."}, order,
              {{"little", BitOrder::Little}, {"big", BitOrder::Big}});
  keys.flag(
      {"signed", "", "Whether the bits are in two's complement. A signed speed also tells backwards from forwards."},
      is_signed);
  keys.number({"scale", "", "The value is bits x `scale` + `offset`. Pulses and counters have neither."}, scale,
              {-1e9, 1e9});
  keys.number({"offset", "", "The value is bits x `scale` + `offset`."}, offset, {-1e9, 1e9});
  keys.number({"min", "",
               "The smallest value. Senders mark a missing value by one outside `min` to `max`, which causes fault "
               "Implausible. If both are 0, every value is allowed."},
              min, {-1e15, 1e15});
  keys.number({"max", "", "The largest value."}, max, {-1e15, 1e15});
}

KeyError CanSignal::validate(std::size_t data_bytes) const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (needed_bytes() > data_bytes)
    return {"start_bit", fmt::format("is {}: {} bits from there on do not fit into {} bytes; allowed: what does",
                                     start_bit, bits, data_bytes)};
  if (scale == 0) return not_allowed("scale", "0", "a number other than 0");
  if (!(min <= max)) return not_allowed("min", number_text(min), "at most max");
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
    // From the most significant bit down. After bit 0 of a byte comes bit 7 of the next byte.
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
  const auto bare_bits = static_cast<std::uint64_t>(bare);
  const double plain = number == CanNumber::Double ? std::bit_cast<double>(bare_bits)
                       : number == CanNumber::Float
                           ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bare_bits)))
                       : is_signed ? static_cast<double>(bare)
                                   : static_cast<double>(bare_bits);
  return plain * scale + offset;
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
