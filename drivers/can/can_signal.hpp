#pragma once

#include <cstdint>
#include <span>

#include "core/keys.hpp"

/// Numbers inside CAN frames, as DBC files describe them.
namespace hueline::drivers {

/// The order of a signal's bits. Little (Intel): `start_bit` is the least significant bit. Big (Motorola): `start_bit`
/// is the most significant bit. As in DBC files, bit 8 i + k is bit k of byte i, where k = 0 is the least significant
/// bit.
enum class BitOrder : std::uint8_t { Little, Big };

/// What the bits of a signal are: a whole number, or a floating-point number of 32 or 64 bits (IEEE 754).
enum class CanNumber : std::uint8_t { Integer, Float, Double };

/// One number in the data of a frame: value = raw bits x scale + offset.
struct CanSignal {
  int start_bit = 0;
  int bits = 8;  ///< 1 to 64
  BitOrder order = BitOrder::Little;
  bool is_signed = false;
  CanNumber number = CanNumber::Integer;
  double scale = 1, offset = 0;  ///< value = raw x scale + offset
  /// The allowed values. If both are 0, all values that the bits can hold (as in DBC files).
  double min = 0, max = 0;

  void visit(Keys& keys);
  /// Checks the signal for a frame with `data_bytes` bytes of data.
  KeyError validate(std::size_t data_bytes = 64) const;
  /// Returns the smallest number of data bytes with which a frame holds the signal.
  std::size_t needed_bytes() const;
  /// Returns the bits as a number, sign-extended if the signal is signed. `data` must have needed_bytes().
  std::int64_t raw(std::span<const std::uint8_t> data) const;
  /// Returns the number x scale + offset. It is not finite if the bits are a floating-point number that is not.
  double value(std::span<const std::uint8_t> data) const;
  /// Returns false for a value outside `min` to `max`. Senders mark "no value" so (usually all bits are set).
  bool allows(double value) const { return (min == 0 && max == 0) || (value >= min && value <= max); }
};

/// The values that a counter takes one after the other before it starts again: `count` values from `least`.
struct CounterRange {
  std::int64_t least = 0, count = 0;
  bool has(std::int64_t value) const { return value >= least && value < least + count; }
  /// Returns the number of steps from `a` forward to `b`, from 0 to count - 1.
  std::int64_t steps(std::int64_t a, std::int64_t b) const { return ((b - a) % count + count) % count; }
};
/// Returns the range of a counter: from its min to its max if it has them, else all values that its bits (at most 62)
/// can hold.
CounterRange counter_range(const CanSignal& counter);

/// Check sums over all bytes of a frame except the byte that holds the check sum.
enum class CanChecksum : std::uint8_t {
  Xor,        ///< exclusive or of the bytes
  Crc8J1850,  ///< SAE J1850: polynomial 0x1D, start value 0xFF, inverted at the end
  Crc8H2f,    ///< AUTOSAR CRC8H2F: polynomial 0x2F, start value 0xFF, inverted at the end
};
/// Computes the check sum of `data` without the byte `without_byte`.
std::uint8_t can_checksum(CanChecksum kind, std::span<const std::uint8_t> data, std::size_t without_byte);

}  // namespace hueline::drivers
