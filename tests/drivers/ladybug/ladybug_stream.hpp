#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/fault.hpp"
#include "drivers/ladybug/ladybug_assembler.hpp"
#include "tests/drivers/packet_pool.hpp"

/// The stream of a Ladybug's endpoint for tests.
namespace hueline::test {

using Bytes = std::vector<std::byte>;

/// Returns an image without planes, whose bytes behind the head depend on `sequence`. It has at least 1024 bytes.
inline Bytes image_of(std::uint32_t sequence, std::size_t size) {
  Bytes out(size);
  for (std::size_t i = 0x60; i < size; ++i) out[i] = static_cast<std::byte>(sequence * 31 + i * 7 + (i >> 8));
  const auto set = [&](std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) out[at + i] = static_cast<std::byte>(value >> (24 - 8 * i));
  };
  set(0x08, size);
  set(0x10, 0xCAFEBABE);
  set(0x14, 2);
  set(0x20, sequence);
  return out;
}

/// What an assembler has made.
struct Told {
  std::vector<Bytes> images;
  std::vector<Fault> faults;
};
inline Told pop_all(drivers::LadybugAssembler& assembler) {
  Told out;
  while (const auto packet = assembler.pop()) {
    const auto bytes = packet->bytes.bytes();
    if (packet->kind == PacketKind::Fault)
      out.faults.push_back(*decode_fault(packet->sensor, packet->received, bytes));
    else
      out.images.emplace_back(bytes.begin(), bytes.end());
  }
  return out;
}

}  // namespace hueline::test
