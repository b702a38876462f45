#include "rosbag/packed_message.hpp"

#include <zstd.h>

#include <cstring>
#include <limits>
#include <utility>

#include "storage/compression.hpp"

namespace hueline::rosbag {

bool is_packed(std::span<const std::byte> message) {
  constexpr unsigned char kPackedMagic[4] = {0x28, 0xB5, 0x2F, 0xFD};  // of Zstandard; a CDR message begins with 0
  return message.size() > 4 && std::memcmp(message.data(), kPackedMagic, 4) == 0;
}

Result<Buffer> unpacked(std::span<const std::byte> packed) {
  const auto size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN || size > kLargestMessage)
    return Error{ErrorCode::Malformed, "a compressed message does not say its size, or a size that is too large"};
  MutableBuffer out = BufferPool(std::numeric_limits<std::size_t>::max() / 2).acquire(static_cast<std::size_t>(size));
  if (Status done = storage::decompress("zstd", packed, out.bytes()); !done.ok()) return done.error();
  return std::move(out).share();
}

}  // namespace hueline::rosbag
