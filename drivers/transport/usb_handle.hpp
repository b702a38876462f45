#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"

struct libusb_context;
struct libusb_device_handle;

namespace hueline::drivers {

/// A device on USB that this program has opened through libusb, with the interfaces that it wants claimed. Only
/// programs that link the module `usb` have it, which are hueline-guest and tests. Thread safety: none; one thread
/// calls all functions.
class UsbHandle {
 public:
  /// An interface of a device in its first setting.
  struct Interface {
    std::uint8_t number = 0;
    std::uint8_t type = 0, subtype = 0, protocol = 0;  ///< bInterfaceClass, bInterfaceSubClass, bInterfaceProtocol
    std::vector<std::uint8_t> endpoints;               ///< addresses; those to the host have bit 7
    /// Whether it belongs to a USB3 Vision camera, by the class codes that USB-IF has given to these.
    bool is_usb3_vision() const { return type == 0xEF && subtype == 0x05; }
  };
  /// A device as its descriptors tell.
  struct Found {
    std::uint16_t vendor = 0, product = 0;
    std::vector<Interface> interfaces;
  };
  /// The devices that are wanted.
  struct Wanted {
    /// Returns the numbers of the interfaces that are claimed; none if the device is not wanted.
    std::function<std::vector<std::uint8_t>(const Found&)> interfaces;
    std::string serial;  ///< that its descriptors name; empty: any
  };

  /// Opens every device that is wanted and claims its interfaces. Those that cannot be opened are left out, and
  /// `refusals` gets one sentence for each that says why and what to do. Errors: Io, libusb does not work here.
  static Result<std::vector<std::unique_ptr<UsbHandle>>> open_all(const Wanted& wanted,
                                                                  std::vector<std::string>& refusals);
  ~UsbHandle();
  UsbHandle(const UsbHandle&) = delete;
  UsbHandle& operator=(const UsbHandle&) = delete;

  const Found& found() const { return found_; }
  /// Returns the device's place and numbers, as `lsusb` lists them: "1e10:3800 on bus 2, device 3".
  const std::string& name() const { return name_; }

  /// Makes a control request of the device's maker. Errors: Disconnected (it is unplugged), TimedOut, Unsupported (it
  /// refused the request), Malformed (it answered with fewer bytes, or took fewer), Io.
  Status read_vendor(std::uint8_t request, std::uint16_t value, std::uint16_t index, std::span<std::byte> out);
  Status write_vendor(std::uint8_t request, std::uint16_t value, std::uint16_t index, std::span<const std::byte> data);

  /// Sends bytes to a bulk endpoint, or receives them from one whose address has bit 7, and returns how many went. A
  /// halt of the endpoint is cleared. Errors: TimedOut (nothing went within `limit`, or the endpoint was halted),
  /// Disconnected, Io.
  Result<std::size_t> bulk(std::uint8_t endpoint, std::span<std::byte> bytes, std::chrono::milliseconds limit);

  /// Returns the packet size of an endpoint. Errors: Unsupported, it has no such endpoint.
  Result<std::size_t> packet_bytes(std::uint8_t endpoint) const;

  libusb_context* context() const { return context_.get(); }
  libusb_device_handle* handle() const { return handle_; }

 private:
  UsbHandle(std::shared_ptr<libusb_context> context, libusb_device_handle* handle, Found found, std::string name)
      : context_(std::move(context)), handle_(handle), found_(std::move(found)), name_(std::move(name)) {}
  int claim(const std::vector<std::uint8_t>& interfaces);

  const std::shared_ptr<libusb_context> context_;
  libusb_device_handle* const handle_;
  const Found found_;
  std::vector<std::uint8_t> claimed_;
  const std::string name_;
};

/// Returns an error of libusb: what was tried, and what came of it.
Error usb_error(const std::string& tried, int code);

}  // namespace hueline::drivers
