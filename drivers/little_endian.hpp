#pragma once

#include <concepts>
#include <cstddef>
#include <span>

/// Whole numbers in packets whose layout is little endian, on every computer. The caller has checked that they lie
/// inside the bytes. (Messages of byte streams have stream_field(), drivers/stream/message_form.hpp.)
namespace hueline::drivers {

/// Returns the number at a place.
template <std::unsigned_integral T>
T get_little(std::span<const std::byte> bytes, std::size_t at) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<T>(value | static_cast<T>(std::to_integer<T>(bytes[at + i]) << (8 * i)));
  return value;
}

/// Writes a number to a place.
template <std::unsigned_integral T>
void put_little(std::span<std::byte> bytes, std::size_t at, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes[at + i] = static_cast<std::byte>(value >> (8 * i));
}

}  // namespace hueline::drivers
