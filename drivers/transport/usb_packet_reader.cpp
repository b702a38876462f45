#include "drivers/transport/usb_packet_reader.hpp"

#include <fmt/format.h>

namespace hueline::drivers {

std::optional<Packet> UsbPacketReader::pop() {
  if (out_.empty()) return std::nullopt;
  Packet packet = std::move(out_.front());
  out_.pop_front();
  return packet;
}

void UsbPacketReader::give_overflow(const PacketMemory& memory, HostTime at) {
  give(
      fault_packet(at, FaultKind::Overflow, 1,
                   fmt::format("an image found no free buffer: {} of {} MB are held, so recorder or pipeline is behind "
                               "(images_in_flight)",
                               memory.bytes_in_use() >> 20U, memory.limit_bytes() >> 20U)));
}

}  // namespace hueline::drivers
