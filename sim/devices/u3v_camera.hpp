#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string>

#include "core/mutex.hpp"
#include "core/result.hpp"
#include "sim/devices/camera_image.hpp"
#include "sim/devices/u3v_registers.hpp"
#include "sim/devices/usb_port.hpp"

namespace hueline::sim {

/// Returns the GUID of the camera with this serial number: 12 hexadecimal digits.
std::string u3v_guid(const std::string& serial);

/// What goes wrong with an image on its way.
enum class U3vFault : std::uint8_t {
  None,
  NoLeader,      ///< the leader is not sent
  NoTrailer,     ///< the trailer is not sent
  ShortPayload,  ///< the second half of the pixels is not sent; the trailer says so
  Stall,         ///< the stream's endpoint halts after half of the pixels, until the host clears that
  Unplug,        ///< the cable is pulled after half of the pixels
};

/// A USB3 Vision camera on the kernel's virtual USB host (usb_port.hpp). Descriptors, control, stream and description
/// are written here, so that a library that a client uses is not tested against itself. As with the GigE Vision camera,
/// the images come from its owner, with one block id each, whatever TriggerMode the client chose.
///
/// The block ids count the images of an acquisition from 0. An image leaves as fast as the host takes it, or at the
/// pace of the link.
///
/// Thread-safe, except that only one thread may call plug(), unplug() and send().
class U3vCamera final : public UsbDevice {
 public:
  struct Config {
    std::string serial = "HL02";          ///< 1 .. 15 characters
    std::uint32_t width = 0, height = 0;  ///< size of the sensor, pixels
    std::string pixel_format = "BayerRG8";
    /// The pace at which bytes become ready for the host; 0: at once. A link of 5 Gbit/s carries about 400e6.
    double link_bytes_per_second = 0;
    std::uint32_t response_ms = 200;   ///< the longest time that the camera says it takes for an answer
    bool reports_exposure = false;     ///< whether it offers its exposure and gain as chunks
    std::uint32_t start_takes_ms = 0;  ///< starting takes so long; the camera then says that its answer is pending
    std::string validate() const;
  };
  /// Makes a camera that is not plugged in. Errors: Invalid (configuration).
  static Result<std::unique_ptr<U3vCamera>> make(const Config& config);
  ~U3vCamera() override;

  /// Plugs the camera in: it starts with its registers as they were made. Errors: those of UsbPort::plug().
  Status plug();
  /// Pulls the cable.
  void unplug();
  /// Returns true while the camera is plugged in and a client has started the stream and the acquisition.
  bool is_streaming() const;
  /// Returns the value of a feature's register (camera_register), as the client has set it.
  std::uint32_t feature(std::uint32_t address) const;

  /// Sends an image and returns when the host has taken it, or when the fault has happened. Errors: Unavailable (nobody
  /// has started the acquisition, or it was stopped or unplugged meanwhile), Invalid (the client's region is not inside
  /// the image), Stopped.
  Status send(const CameraImage& image, const std::stop_token& stop, U3vFault fault = U3vFault::None);

  const UsbDescriptors& descriptors() const override { return descriptors_; }
  void receive(std::uint8_t endpoint, std::span<const std::byte> bytes) override;
  void endpoint_was_reset(std::uint8_t) override {}

 private:
  explicit U3vCamera(const Config& config);
  Bytes obey(std::span<const std::byte> command, bool& is_start);
  bool send_payload(UsbPort& port, const Buffer& pixels, const std::stop_token& stop) const;

  const Config config_;
  const UsbDescriptors descriptors_;
  mutable Mutex mutex_;
  std::unique_ptr<U3vRegisters> registers_ HUELINE_GUARDED_BY(mutex_);
  std::uint64_t acquisitions_ HUELINE_GUARDED_BY(mutex_) = 0;
  std::unique_ptr<UsbPort> port_ HUELINE_GUARDED_BY(mutex_);

  // Used by the thread that sends.
  std::uint64_t numbered_acquisition_ = 0, first_sequence_ = 0;
};

}  // namespace hueline::sim
