#pragma once

#include <memory>
#include <utility>

#include "core/packet.hpp"
#include "drivers/guest/packet_memory.hpp"
#include "drivers/ladybug/ladybug_settings.hpp"

namespace hueline::drivers::guest {
class HostLink;
}

namespace hueline::drivers {

/// Reads the images of a Ladybug on USB: registers by vendor requests of the control endpoint, images by the bulk
/// endpoint 0x81, as libdc1394's back end for IIDC over USB shows both (dc1394/usb). libdc1394 itself does not serve:
/// it opens only the models of a list, which has no Ladybug; it asks for a whole image in one transfer, where a stall
/// or a cable that is pulled ends in an error without a name; and behind lost bytes it does not find the next image.
///
/// A packet is one image (LadybugAssembler). `Packet::received` is when its last bytes had come.
/// Fault packets: those of LadybugAssembler.
/// Errors: open(): Unavailable (no such camera, it may not be opened, or too little memory for transfers), Invalid (the
/// camera has not or did not take a setting), Disconnected, Io. next(): those of UsbPacketStream.
/// Thread safety: none; one thread calls all functions.
class LadybugUsbSource final : public PacketSource {
 public:
  LadybugUsbSource(LadybugSettings settings, std::shared_ptr<PacketMemory> memory);
  ~LadybugUsbSource() override;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  struct Open;
  const LadybugSettings settings_;
  const std::shared_ptr<PacketMemory> memory_;
  std::unique_ptr<Open> open_;
};

/// Makes the source of a guest whose driver is `ladybug`. Errors: Malformed, Invalid (the settings).
Result<std::unique_ptr<PacketSource>> make_ladybug_guest(guest::HostLink& link);

}  // namespace hueline::drivers
