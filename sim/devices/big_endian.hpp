#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "sim/wire/little_endian.hpp"

/// Numbers in network byte order, for GigE Vision.
namespace hueline::sim {

inline void put_be16(Bytes& out, std::uint32_t value) {
  out.push_back(static_cast<std::byte>(value >> 8U & 0xffU));
  out.push_back(static_cast<std::byte>(value & 0xffU));
}
inline void put_be32(Bytes& out, std::uint32_t value) {
  put_be16(out, value >> 16U);
  put_be16(out, value & 0xffffU);
}
/// Return the number at offset `at`. The caller has checked that the bytes are there.
inline std::uint32_t get_be16(std::span<const std::byte> bytes, std::size_t at) {
  return std::to_integer<std::uint32_t>(bytes[at]) << 8U | std::to_integer<std::uint32_t>(bytes[at + 1]);
}
inline std::uint32_t get_be32(std::span<const std::byte> bytes, std::size_t at) {
  return get_be16(bytes, at) << 16U | get_be16(bytes, at + 2);
}

}  // namespace hueline::sim
