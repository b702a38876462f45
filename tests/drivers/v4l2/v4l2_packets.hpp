#pragma once

#include <initializer_list>
#include <span>
#include <vector>

#include "core/packet.hpp"
#include "drivers/v4l2/v4l2_packet.hpp"

namespace hueline::test {

inline std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

/// A packet as V4l2Source makes it. `used_bytes` of the header is set.
inline Packet v4l2_packet(drivers::V4l2Header header, std::span<const std::byte> image) {
  header.used_bytes = static_cast<std::uint32_t>(image.size());
  std::vector<std::byte> bytes(drivers::kV4l2HeaderSize);
  drivers::encode_v4l2_header(header, std::span(bytes).first<drivers::kV4l2HeaderSize>());
  bytes.insert(bytes.end(), image.begin(), image.end());
  return {.sensor = 3, .sequence = 77, .received = host_time_ns(9), .bytes = Buffer::copy_of(bytes)};
}

}  // namespace hueline::test
