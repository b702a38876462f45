#pragma once

#include <cstddef>
#include <vector>

#include "core/packet.hpp"

namespace hueline::runtime {

/// Returns a packet of a device with so many bytes, all zero.
inline Packet packet_of(SensorId sensor, std::size_t size = 100) {
  Packet packet;
  packet.sensor = sensor;
  packet.bytes = Buffer::copy_of(std::vector<std::byte>(size));
  return packet;
}

}  // namespace hueline::runtime
