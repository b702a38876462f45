#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "core/measurements.hpp"
#include "core/packet.hpp"
#include "drivers/can/can_frame.hpp"
#include "drivers/transport/can_log_source.hpp"

/// Frames and packets for tests.
namespace hueline::test {

inline drivers::CanFrame can_frame(std::uint32_t id, std::initializer_list<int> bytes) {
  drivers::CanFrame frame;
  frame.id = id;
  for (const int byte : bytes) frame.data[frame.length++] = static_cast<std::uint8_t>(byte);
  return frame;
}
inline drivers::CanFrame can_error(std::uint32_t classes, std::initializer_list<int> bytes = {0, 0, 0, 0, 0, 0, 0, 0}) {
  drivers::CanFrame frame = can_frame(classes, bytes);
  frame.is_error = true;
  return frame;
}
inline Packet can_packet(const drivers::CanFrame& frame, double at_s) {
  Packet packet;
  packet.sensor = 3;
  packet.received = HostTime(from_seconds(at_s));
  packet.bytes = Buffer::copy_of(drivers::encode_can_packet(frame));
  return packet;
}
inline std::vector<std::byte> bytes_of(std::initializer_list<int> bytes) {
  std::vector<std::byte> out;
  for (const int byte : bytes) out.push_back(static_cast<std::byte>(byte));
  return out;
}
/// All packets of a log, and its faults apart.
inline std::vector<Packet> read_can_log(const std::string& path, std::vector<Fault>& faults, int channel = 0) {
  drivers::CanLogSource source({path, channel});
  std::vector<Packet> out;
  if (!source.open().ok()) return out;
  for (;;) {
    Result<Packet> packet = source.next({});
    if (!packet.ok()) break;
    if (packet->kind == PacketKind::Fault)
      faults.push_back(*decode_fault(packet->sensor, packet->received, packet->bytes.bytes()));
    else
      out.push_back(std::move(*packet));
  }
  return out;
}

}  // namespace hueline::test
