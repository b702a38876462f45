#include "drivers/novatel/crc32.hpp"

#include <libdeflate.h>

namespace hueline::drivers {

std::uint32_t novatel_crc32(std::span<const std::byte> bytes) {
  if (bytes.empty()) return 0;  // libdeflate gives its own starting value for a null pointer
  // libdeflate inverts the register before and after. Handing it all ones makes its register start at 0, and inverting
  // its answer takes its final inversion back.
  return ~libdeflate_crc32(0xFFFFFFFFu, bytes.data(), bytes.size());
}

}  // namespace hueline::drivers
