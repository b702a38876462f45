#pragma once

#include <cstddef>
#include <cstdint>

namespace hueline::drivers {

/// Read a number in the byte order of networks from the bytes at `p`.
inline std::uint16_t be16(const std::byte* p) {
  return static_cast<std::uint16_t>(static_cast<unsigned>(p[0]) << 8 | static_cast<unsigned>(p[1]));
}
inline std::uint32_t be32(const std::byte* p) { return static_cast<std::uint32_t>(be16(p)) << 16 | be16(p + 2); }

}  // namespace hueline::drivers
