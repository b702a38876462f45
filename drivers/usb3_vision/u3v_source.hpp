#pragma once

#include <memory>
#include <string>

#include "core/packet.hpp"
#include "drivers/gige/genicam_config.hpp"
#include "drivers/guest/packet_memory.hpp"

namespace hueline::drivers {

/// Receives the images of a USB3 Vision camera: commands (gencp.hpp) and the image stream by libusb, and the camera's
/// features by Aravis's GenICam. Aravis's own stream has one transfer under way at a time, gives a slow image up and
/// tries a halted endpoint for ever; here many are under way, a halt is cleared, and everything that is lost has a
/// name.
///
/// A packet is one image (U3vAssembler). `Packet::received` is when the transfer with its trailer had come.
/// Fault packets: those of U3vAssembler.
/// Errors of open(): Unavailable (no such camera, it may not be opened, it does not answer, or there is too little
/// memory for transfers); Invalid (it refuses a setting, or has no image stream). Errors of next(): those of
/// UsbPacketStream.
/// Thread safety: none; one thread calls all functions. open() gives that thread its real-time priority.
class U3vSource final : public PacketSource {
 public:
  /// `serial` is the camera's serial number, whatever `config` names it by.
  U3vSource(GenicamConfig config, std::string serial, std::shared_ptr<PacketMemory> memory);
  ~U3vSource() override;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  struct Open;

  const GenicamConfig config_;
  const std::string serial_;
  const std::shared_ptr<PacketMemory> memory_;
  std::unique_ptr<Open> open_;
};

/// Returns whether a USB3 Vision camera with this serial number is on USB. It asks the kernel and opens no device.
bool is_u3v_on_usb(const std::string& serial);

}  // namespace hueline::drivers
