#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.hpp"
#include "core/result.hpp"

namespace hueline::rosbag {

/// The largest message that is read. An image of a hundred million pixels with three colours takes half of it.
constexpr std::uint64_t kLargestMessage = 512u << 20;

/// Returns whether rosbag2 has compressed a CDR message by itself (--compression-mode message), which is possible in
/// both of its storages.
bool is_packed(std::span<const std::byte> message);

/// Unpacks such a message. Errors: Malformed.
Result<Buffer> unpacked(std::span<const std::byte> packed);

}  // namespace hueline::rosbag
