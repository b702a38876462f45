#include "drivers/novatel/crc32.hpp"

#include <libdeflate.h>

namespace hueline::drivers {

std::uint32_t novatel_crc32(std::span<const std::byte> bytes) {
  if (bytes.empty()) return 0;  // for a null pointer libdeflate returns its own starting value
  // libdeflate inverts the register before and after. With all ones as its argument, its register starts at 0.
  // Inverting its result undoes its final inversion.
  return ~libdeflate_crc32(0xFFFFFFFFu, bytes.data(), bytes.size());
}

}  // namespace hueline::drivers
