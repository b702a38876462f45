#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/buffer.hpp"
#include "core/mutex.hpp"
#include "core/result.hpp"
#include "sim/devices/socket.hpp"
#include "sim/wire/little_endian.hpp"

namespace hueline::sim {

/// What a USB device says of itself when it is plugged in: the descriptors of USB 3.2, chapter 9.6.
struct UsbDescriptors {
  Bytes device, configuration, capabilities;  ///< the last is the Binary device Object Store (BOS)
  std::vector<std::string> strings;           ///< number 1 first; ASCII
};

/// A request on the control endpoint that is the device's own: of its maker.
struct UsbVendorRequest {
  bool is_read = false;
  std::uint8_t number = 0;             ///< bRequest
  std::uint16_t value = 0, index = 0;  ///< wValue, wIndex
  std::span<const std::byte> data;     ///< that came with it
};

/// The inside of an emulated USB device with bulk endpoints. The port calls it from its own thread.
class UsbDevice {
 public:
  UsbDevice() = default;
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;
  virtual ~UsbDevice() = default;
  virtual const UsbDescriptors& descriptors() const = 0;
  /// Takes the bytes of one transfer to the device. May call UsbPort::send().
  virtual void receive(std::uint8_t endpoint, std::span<const std::byte> bytes) = 0;
  /// The host has halted an endpoint to the host, or cleared its halt. What the port had queued there is dropped.
  virtual void endpoint_was_reset(std::uint8_t endpoint) = 0;
  /// Returns the answer, which is empty for a request that writes. Errors: the device has no such request, or refuses
  /// it; for the host that is a stall.
  virtual Result<Bytes> answer(const UsbVendorRequest&) {
    return Error{ErrorCode::Unsupported, "the device has no requests of its maker"};
  }
};

/// A port of the kernel's virtual USB host controller (module vhci_hcd) with an emulated SuperSpeed device in it. For
/// the kernel and every program the device is one on a cable. It needs root, and no other program: the kernel's end of
/// a socket pair is written to the controller's `attach` file, and the transfers come over it as USB/IP messages (the
/// kernel's Documentation/usb/usbip_protocol.rst).
///
/// Endpoints to the host behave as a wire does: bytes wait until the host asks for them, a transfer ends when it is
/// full or with a packet that is shorter than the others, and a transfer that is cut into a packet is an overflow.
/// What a cancelled transfer had received is delivered with it, so a host that drops it loses these bytes.
///
/// Thread-safe. The device must outlive the port.
class UsbPort {
 public:
  /// The packet size of a SuperSpeed bulk endpoint.
  static constexpr std::size_t kPacketBytes = 1024;

  /// Plugs the device in. The kernel reads the descriptors after this function returns. Errors: Unavailable (the module
  /// is not loaded, no port is free, or this program may not attach), Io.
  static Result<std::unique_ptr<UsbPort>> plug(UsbDevice& device);
  /// Unplugs the device.
  ~UsbPort();
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;

  /// Pulls the cable: transfers under way end with errors, as they do on a host that lost a device.
  void unplug();
  bool is_plugged() const;

  /// Queues bytes for the host on an endpoint, 1 .. 15. A size that is no multiple of kPacketBytes ends with a short
  /// packet.
  void send(std::uint8_t endpoint, Buffer bytes);
  /// Waits until the host has taken all bytes of the endpoint. Returns false if it was stopped or unplugged, or if the
  /// bytes were dropped, before that.
  bool wait_until_taken(std::uint8_t endpoint, const std::stop_token& stop);
  /// Drops what waits on an endpoint.
  void drop(std::uint8_t endpoint);
  /// Halts an endpoint: its transfers end with an error (a stall) until the host clears the halt.
  void stall(std::uint8_t endpoint);
  /// Returns whether an endpoint is halted: what is sent there is dropped.
  bool is_halted(std::uint8_t endpoint) const;

 private:
  struct Request;  // one transfer that the host wants
  struct Waiting {
    Buffer bytes;
    std::size_t taken = 0;
  };
  struct Endpoint {
    std::deque<Request> requests;
    std::deque<Waiting> waiting;
    bool is_halted = false;
    std::uint64_t drops = 0;  // how often waiting bytes were dropped
  };
  UsbPort(UsbDevice& device, FileDescriptor socket);
  void run();
  bool take_message();
  void submit(Request request, std::span<const std::byte> bytes);
  void unlink(std::uint32_t sequence, std::uint32_t unlinked);
  void control(const Request& request, std::span<const std::byte> bytes);
  Result<Bytes> answer_control(const Request& request, std::span<const std::byte> bytes);
  Bytes descriptor(std::uint32_t type, std::uint32_t number) const;
  void reset(std::uint32_t address, bool is_halted);
  void serve(Endpoint& endpoint) HUELINE_REQUIRES(mutex_);
  void complete(const Request& request, int error, std::span<const std::span<const std::byte>> parts)
      HUELINE_REQUIRES(mutex_);
  void write(std::span<const std::byte> head, std::span<const std::span<const std::byte>> parts)
      HUELINE_REQUIRES(mutex_);

  UsbDevice& device_;
  const FileDescriptor socket_;
  mutable Mutex mutex_;
  std::condition_variable_any changed_;
  bool is_plugged_ HUELINE_GUARDED_BY(mutex_) = true;
  std::array<Endpoint, 16> in_ HUELINE_GUARDED_BY(mutex_);
  std::uint8_t configuration_ = 0;  // used by the thread only
  std::jthread thread_;
};

}  // namespace hueline::sim
