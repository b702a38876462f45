#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/pcap_writer.hpp"

namespace hueline::test {

/// Writes packets of Livox scanners, from the maker's descriptions. It shares no code with the decoder.
struct LivoxFirst {
  std::uint32_t status = 0;
  unsigned time_type = 0, data_type = 2;
  std::array<unsigned, 2> scanner{1, 1};
  Bytes time = ByteWriter(false).u64(1'000'000'000).bytes();

  /// `points`: the bytes of the packet's points.
  Bytes bytes(std::span<const std::byte> points) const {
    return ByteWriter(false)
        .u8(5)
        .u8(scanner[0])
        .u8(scanner[1])
        .u8(0)
        .u32(status)
        .u8(time_type)
        .u8(data_type)
        .raw(time)
        .raw(points)
        .bytes();
  }
};

struct LivoxSecond {
  unsigned time_type = 0, data_type = 1, sequence = 0, time_interval = 4800;
  std::uint64_t time_ns = 1'000'000'000;

  Bytes bytes(std::span<const std::byte> points, unsigned count) const {
    return ByteWriter(false)
        .u8(0)
        .u16(36 + static_cast<unsigned>(points.size()))
        .u16(time_interval)
        .u16(count)
        .u16(sequence)
        .u8(0)
        .u8(data_type)
        .u8(time_type)
        .zeros(12)
        .u32(0)
        .u64(time_ns)
        .raw(points)
        .bytes();
  }
};

}  // namespace hueline::test
