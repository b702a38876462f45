#include "drivers/transport/usb_handle.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr unsigned kAnswersWithin_ms = 1000;
constexpr std::uint8_t kReadOfMaker = 0xC0, kWriteOfMaker = 0x40;  // bmRequestType

/// Returns what the descriptors of a device say, or nothing if they cannot be read.
Result<UsbHandle::Found> describe(libusb_device* device) {
  libusb_device_descriptor of_device{};
  libusb_config_descriptor* configuration = nullptr;
  int failed = libusb_get_device_descriptor(device, &of_device);
  if (failed == 0) failed = libusb_get_config_descriptor(device, 0, &configuration);
  if (failed != 0) return usb_error("read the descriptors of a device", failed);
  UsbHandle::Found found;
  found.vendor = of_device.idVendor;
  found.product = of_device.idProduct;
  for (int i = 0; i < configuration->bNumInterfaces; ++i) {
    if (configuration->interface[i].num_altsetting < 1) continue;
    const libusb_interface_descriptor& described = configuration->interface[i].altsetting[0];
    UsbHandle::Interface interface {
      .number = described.bInterfaceNumber, .type = described.bInterfaceClass, .subtype = described.bInterfaceSubClass,
      .protocol = described.bInterfaceProtocol, .endpoints = {}
    };
    for (int k = 0; k < described.bNumEndpoints; ++k)
      interface.endpoints.push_back(described.endpoint[k].bEndpointAddress);
    found.interfaces.push_back(std::move(interface));
  }
  libusb_free_config_descriptor(configuration);
  return found;
}

/// Returns the serial number that the descriptors of an open device name; empty if there is none.
std::string serial_of(libusb_device* device, libusb_device_handle* handle) {
  libusb_device_descriptor described{};
  if (libusb_get_device_descriptor(device, &described) != 0 || described.iSerialNumber == 0) return {};
  std::array<unsigned char, 256> text{};
  const int size =
      libusb_get_string_descriptor_ascii(handle, described.iSerialNumber, text.data(), static_cast<int>(text.size()));
  return size > 0 ? std::string(text.begin(), text.begin() + size) : std::string();
}

std::string what_to_do(int code) {
  if (code == LIBUSB_ERROR_ACCESS) return "; give this user the right to it, as packaging/udev/60-hueline.rules does";
  if (code == LIBUSB_ERROR_BUSY) return "; another program uses it: end that program";
  return {};
}

}  // namespace

Error usb_error(const std::string& tried, int code) {
  const auto kind = [&] {
    switch (code) {
      case LIBUSB_ERROR_NO_DEVICE:
        return ErrorCode::Disconnected;
      case LIBUSB_ERROR_TIMEOUT:
        return ErrorCode::TimedOut;
      case LIBUSB_ERROR_PIPE:
        return ErrorCode::Unsupported;
      case LIBUSB_ERROR_ACCESS:
      case LIBUSB_ERROR_BUSY:
      case LIBUSB_ERROR_NO_MEM:
        return ErrorCode::Unavailable;
      default:
        return ErrorCode::Io;
    }
  }();
  return {kind, fmt::format("USB: cannot {}: {}", tried, libusb_strerror(code))};
}

Result<std::vector<std::unique_ptr<UsbHandle>>> UsbHandle::open_all(const Wanted& wanted,
                                                                    std::vector<std::string>& refusals) {
  libusb_context* made = nullptr;
  if (const int failed = libusb_init(&made); failed != 0) return usb_error("start libusb", failed);
  const std::shared_ptr<libusb_context> context(made, libusb_exit);
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context.get(), &list);
  if (count < 0) return usb_error("list the devices", static_cast<int>(count));
  std::vector<std::unique_ptr<UsbHandle>> out;
  for (libusb_device* device : std::span(list, static_cast<std::size_t>(count))) {
    const auto found = describe(device);
    if (!found) continue;
    const std::vector<std::uint8_t> interfaces = wanted.interfaces(*found);
    if (interfaces.empty()) continue;
    std::string name = fmt::format("{:04x}:{:04x} on bus {}, device {}", found->vendor, found->product,
                                   libusb_get_bus_number(device), libusb_get_device_address(device));
    libusb_device_handle* handle = nullptr;
    int failed = libusb_open(device, &handle);
    if (failed == 0) {
      std::unique_ptr<UsbHandle> opened(new UsbHandle(context, handle, *found, name));
      // Asked for before the interfaces are claimed, which would take another program's camera from it for a moment.
      if (!wanted.serial.empty() && serial_of(device, handle) != wanted.serial) continue;
      failed = opened->claim(interfaces);
      if (failed == 0) out.push_back(std::move(opened));
    }
    if (failed != 0) refusals.push_back(usb_error("open " + name, failed).message + what_to_do(failed));
  }
  libusb_free_device_list(list, 1);
  return out;
}

int UsbHandle::claim(const std::vector<std::uint8_t>& interfaces) {
  for (const std::uint8_t interface : interfaces) {
    if (const int failed = libusb_claim_interface(handle_, interface); failed != 0) return failed;
    claimed_.push_back(interface);
  }
  return 0;
}

UsbHandle::~UsbHandle() {
  for (const std::uint8_t interface : claimed_) libusb_release_interface(handle_, interface);
  libusb_close(handle_);
}

Status UsbHandle::read_vendor(std::uint8_t request, std::uint16_t value, std::uint16_t index,
                              std::span<std::byte> out) {
  const int read = libusb_control_transfer(handle_, kReadOfMaker, request, value, index,
                                           reinterpret_cast<unsigned char*>(out.data()),
                                           static_cast<std::uint16_t>(out.size()), kAnswersWithin_ms);
  if (read < 0) return usb_error("read a register of " + name_, read);
  if (static_cast<std::size_t>(read) != out.size())
    return Error{ErrorCode::Malformed, fmt::format("USB: {} answered with {} of {} bytes", name_, read, out.size())};
  return {};
}

Status UsbHandle::write_vendor(std::uint8_t request, std::uint16_t value, std::uint16_t index,
                               std::span<const std::byte> data) {
  std::vector<std::byte> bytes(data.begin(), data.end());  // libusb takes no const bytes
  const int written = libusb_control_transfer(handle_, kWriteOfMaker, request, value, index,
                                              reinterpret_cast<unsigned char*>(bytes.data()),
                                              static_cast<std::uint16_t>(bytes.size()), kAnswersWithin_ms);
  if (written < 0) return usb_error("write a register of " + name_, written);
  if (static_cast<std::size_t>(written) != data.size())
    return Error{ErrorCode::Malformed, fmt::format("USB: {} took {} of {} bytes", name_, written, data.size())};
  return {};
}

Result<std::size_t> UsbHandle::bulk(std::uint8_t endpoint, std::span<std::byte> bytes,
                                    std::chrono::milliseconds limit) {
  constexpr std::int64_t kForEver = 0;
  const auto limit_ms = static_cast<unsigned>(std::max<std::int64_t>(kForEver + 1, limit.count()));
  int went = 0;
  const int failed = libusb_bulk_transfer(handle_, endpoint, reinterpret_cast<unsigned char*>(bytes.data()),
                                          static_cast<int>(bytes.size()), &went, limit_ms);
  if (failed == 0) return static_cast<std::size_t>(went);
  if (failed == LIBUSB_ERROR_PIPE && libusb_clear_halt(handle_, endpoint) == 0)
    return Error{ErrorCode::TimedOut, fmt::format("USB: {} halted its endpoint 0x{:02x}", name_, endpoint)};
  return usb_error("exchange a message with " + name_, failed);
}

Result<std::size_t> UsbHandle::packet_bytes(std::uint8_t endpoint) const {
  const int bytes = libusb_get_max_packet_size(libusb_get_device(handle_), endpoint);
  if (bytes > 0) return static_cast<std::size_t>(bytes);
  return Error{ErrorCode::Unsupported, fmt::format("USB: {} has no endpoint 0x{:02x}", name_, endpoint)};
}

}  // namespace hueline::drivers
