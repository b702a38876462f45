#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "core/packet.hpp"
#include "drivers/guest/packet_memory.hpp"
#include "drivers/transport/usb_bulk_stream.hpp"

namespace hueline::drivers {

/// The common part of what puts packets together from the bytes of a camera's bulk endpoint: the packets that are
/// ready. Thread safety: none; one thread calls all functions.
class UsbPacketReader : public UsbBulkReader {
 public:
  /// Returns the next packet, if there is one.
  std::optional<Packet> pop();

 protected:
  void give(Packet packet) { out_.push_back(std::move(packet)); }
  /// Gives a fault: an image for which `memory` had no room.
  void give_overflow(const PacketMemory& memory, HostTime at);

 private:
  std::deque<Packet> out_;
};

}  // namespace hueline::drivers
