#include "rosbag/packed_message.hpp"

#include <zstd.h>

#include <limits>
#include <string_view>
#include <utility>

#include "core/packed_file.hpp"
#include "storage/compression.hpp"

namespace hueline::rosbag {

bool is_packed(std::span<const std::byte> message) {
  const std::string_view bytes(reinterpret_cast<const char*>(message.data()), message.size());
  return bytes.size() > kZstdMagic.size() && bytes.starts_with(kZstdMagic);  // a CDR message begins with 0
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
