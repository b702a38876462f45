#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

struct libusb_context;
struct libusb_device_handle;

namespace hueline::drivers {

/// A device on USB that this program has opened through libusb, with one interface claimed. Only programs that link
/// the module `usb` have it, which are hueline-guest and tests.
/// Thread safety: none; one thread calls all functions.
class UsbHandle {
 public:
  /// A device as its descriptors tell.
  struct Found {
    std::uint16_t vendor = 0, product = 0;
    std::uint8_t interface_class = 0, interface_subclass = 0;  ///< of interface 0
    std::vector<std::uint8_t> endpoints;                       ///< addresses of the endpoints of interface 0
  };
  using IsWanted = bool (*)(const Found&);

  /// Opens every device that is wanted and claims its interface 0. Those that cannot be opened are left out, and
  /// `refusals` gets one sentence for each that says why and what to do. Errors: Io, libusb does not work here.
  static Result<std::vector<std::unique_ptr<UsbHandle>>> open_all(IsWanted is_wanted,
                                                                  std::vector<std::string>& refusals);
  ~UsbHandle();
  UsbHandle(const UsbHandle&) = delete;
  UsbHandle& operator=(const UsbHandle&) = delete;

  /// Returns the device's place and numbers, as `lsusb` lists them: "1e10:3800 on bus 2, device 3".
  const std::string& name() const { return name_; }

  /// Makes a control request of the device's maker. Errors: Disconnected (it is unplugged), TimedOut, Unsupported (it
  /// refused the request), Malformed (it answered with fewer bytes, or took fewer), Io.
  Status read_vendor(std::uint8_t request, std::uint16_t value, std::uint16_t index, std::span<std::byte> out);
  Status write_vendor(std::uint8_t request, std::uint16_t value, std::uint16_t index, std::span<const std::byte> data);

  /// Returns the packet size of an endpoint. Errors: Unsupported, it has no such endpoint.
  Result<std::size_t> packet_bytes(std::uint8_t endpoint) const;

  libusb_context* context() const { return context_.get(); }
  libusb_device_handle* handle() const { return handle_; }

 private:
  UsbHandle(std::shared_ptr<libusb_context> context, libusb_device_handle* handle, std::string name);

  const std::shared_ptr<libusb_context> context_;
  libusb_device_handle* const handle_;
  const std::string name_;
};

/// Returns an error of libusb: what was tried, and what came of it.
Error usb_error(const std::string& tried, int code);

}  // namespace hueline::drivers
