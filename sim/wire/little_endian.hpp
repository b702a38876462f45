#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace hueline::sim {

/// The bytes of one message as they go on the wire.
using Bytes = std::vector<std::byte>;

/// Appends numbers with the least significant byte first, whatever the byte order of the machine.
class LittleEndianWriter {
 public:
  explicit LittleEndianWriter(std::size_t expected_size) { bytes_.reserve(expected_size); }

  template <std::integral T>
  void put(T value) {
    auto rest = static_cast<std::make_unsigned_t<T>>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<std::byte>(rest & 0xffU));
      if constexpr (sizeof(T) > 1) rest = static_cast<decltype(rest)>(rest >> 8U);
    }
  }
  void put(float value) { put(std::bit_cast<std::uint32_t>(value)); }
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }

  void put_bytes(std::initializer_list<int> bytes) {
    for (const int byte : bytes) put(static_cast<std::uint8_t>(byte));
  }
  void put_zeros(std::size_t count) { bytes_.resize(bytes_.size() + count); }
  void put_text(std::string_view text) {
    for (const char c : text) bytes_.push_back(static_cast<std::byte>(c));
  }

  std::size_t size() const { return bytes_.size(); }
  const Bytes& bytes() const { return bytes_; }
  /// Moves the bytes out; the writer must not be used afterwards.
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

}  // namespace hueline::sim
