#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "core/result.hpp"

/// Points of clouds as ROS's point_cloud_transport compresses them without loss.
namespace hueline::drivers {

/// The most bytes of the points of a message: no scanner sends half as many.
constexpr std::size_t kMostPointBytes = std::size_t{512} << 20;

/// Unpacks the points of a message whose `format` is zstd or zlib (in a gzip or a zlib frame). `most`: how many bytes
/// they may have, kMostPointBytes or less. Errors: Unsupported for another format, which it names (draco and cloudini
/// change the points); Malformed.
Result<std::vector<std::byte>> unpacked_points(std::string_view format, std::span<const std::byte> packed,
                                               std::size_t most);

}  // namespace hueline::drivers
