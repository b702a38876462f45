#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>

#include "core/buffer.hpp"
#include "core/mutex.hpp"
#include "core/result.hpp"
#include "sim/devices/ladybug_registers.hpp"
#include "sim/devices/usb_port.hpp"

namespace hueline::sim {

/// What goes wrong with an image of a LadybugCamera on its way.
enum class LadybugFault : std::uint8_t {
  None,
  Short,    ///< the image ends in its middle, with a short packet
  Stall,    ///< the endpoint halts in the middle, until the host clears that
  Strange,  ///< bytes that are no image come instead
  Unplug,   ///< the cable is pulled in the middle
};

/// A Ladybug on the kernel's virtual USB host (usb_port.hpp): registers of IIDC by requests of its maker, images by the
/// bulk endpoint 0x81, as libdc1394's back end for IIDC over USB reads both. The images come from its owner.
///
/// Thread-safe, except that only one thread may call plug(), unplug() and send().
class LadybugCamera final : public UsbDevice {
 public:
  struct Config {
    std::uint32_t serial = 15'123'456;
    std::uint16_t product = 0x3800;
    /// Whether an image is followed by the rest of the camera's buffer. Otherwise a short packet ends it.
    bool sends_whole_buffer = true;
  };
  explicit LadybugCamera(const Config& config);
  ~LadybugCamera() override;

  /// Plugs the camera in: it starts with its registers as they were made. Errors: those of UsbPort::plug().
  Status plug();
  /// Pulls the cable.
  void unplug();
  /// Returns true while the camera is plugged in and a client has started the stream.
  bool is_streaming() const;
  /// Returns a register as the client has set it (ladybug_register).
  std::uint32_t get(std::uint32_t address) const;
  float get_float(std::uint32_t address) const;

  /// Sends the bytes of an image and returns when the host has taken them, or when the fault has happened. Errors:
  /// Unavailable (nobody has started the stream, it ended meanwhile, or the endpoint is halted), Invalid (the image is
  /// larger than the camera's buffer), Stopped.
  Status send(const Buffer& image, const std::stop_token& stop, LadybugFault fault = LadybugFault::None);

  const UsbDescriptors& descriptors() const override { return descriptors_; }
  void receive(std::uint8_t, std::span<const std::byte>) override {}
  void endpoint_was_reset(std::uint8_t) override {}
  Result<Bytes> answer(const UsbVendorRequest& request) override;

 private:
  const Config config_;
  const UsbDescriptors descriptors_;
  mutable Mutex mutex_;
  LadybugRegisters registers_ HUELINE_GUARDED_BY(mutex_);
  std::unique_ptr<UsbPort> port_ HUELINE_GUARDED_BY(mutex_);
};

}  // namespace hueline::sim
