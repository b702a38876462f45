#pragma once

#include <cstdint>
#include <span>

#include "core/keys.hpp"

/// Numbers inside CAN frames, as the field's DBC files describe them.
namespace hueline::drivers {

/// Little: Intel, `start_bit` is the least significant bit. Big: Motorola, `start_bit` is the most significant one.
/// Either way bit 8 i + k is bit k (1 is the least significant) of byte i, as in DBC files.
enum class BitOrder : std::uint8_t { Little, Big };

struct CanSignal {
  int start_bit = 0;
  int bits = 8;  ///< [1, 64]
  BitOrder order = BitOrder::Little;
  bool is_signed = false;
  double scale = 1, offset = 0;  ///< value = raw x scale + offset
  /// Allowed values; both 0: all that the bits can hold (as DBC files say it).
  double min = 0, max = 0;

  void visit(Keys& keys);
  /// `data_bytes`: of the frame.
  KeyError validate(std::size_t data_bytes = 64) const;
  /// Bytes of data that a frame must have at least to hold it.
  std::size_t needed_bytes() const;
  /// The bits as they stand; sign extended if signed. The frame holds them: needed_bytes().
  std::int64_t raw(std::span<const std::uint8_t> data) const;
  double value(std::span<const std::uint8_t> data) const;
  /// False for what the sender marks as no value (all bits set is usual) or cannot mean.
  bool allows(double value) const { return (min == 0 && max == 0) || (value >= min && value <= max); }
};

/// The values that a counter takes, one after the other, before it begins anew.
struct CounterRange {
  std::int64_t least = 0, count = 0;
  bool has(std::int64_t value) const { return value >= least && value < least + count; }
  /// From `a` on to `b`, in [0, count).
  std::int64_t steps(std::int64_t a, std::int64_t b) const { return ((b - a) % count + count) % count; }
};
/// Its min to its max, where it has such; else all that its bits (at most 62) can hold.
CounterRange counter_range(const CanSignal& counter);

/// Check sums over all bytes of a frame but the one that holds it.
enum class CanChecksum : std::uint8_t {
  Xor,        ///< of all bytes
  Crc8J1850,  ///< SAE J1850: polynomial 0x1D, begins with and is inverted by 0xFF
  Crc8H2f,    ///< AUTOSAR CRC8H2F: polynomial 0x2F, likewise
};
std::uint8_t can_checksum(CanChecksum kind, std::span<const std::uint8_t> data, std::size_t without_byte);

}  // namespace hueline::drivers
