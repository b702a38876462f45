#include "drivers/transport/usb_handle.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <utility>

namespace hueline::drivers {
namespace {

constexpr int kInterface = 0;
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
  if (configuration->bNumInterfaces > 0 && configuration->interface[0].num_altsetting > 0) {
    const libusb_interface_descriptor& interface = configuration->interface[0].altsetting[0];
    found.interface_class = interface.bInterfaceClass;
    found.interface_subclass = interface.bInterfaceSubClass;
    for (int i = 0; i < interface.bNumEndpoints; ++i) found.endpoints.push_back(interface.endpoint[i].bEndpointAddress);
  }
  libusb_free_config_descriptor(configuration);
  return found;
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

Result<std::vector<std::unique_ptr<UsbHandle>>> UsbHandle::open_all(IsWanted is_wanted,
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
    if (!found || !is_wanted(*found)) continue;
    std::string name = fmt::format("{:04x}:{:04x} on bus {}, device {}", found->vendor, found->product,
                                   libusb_get_bus_number(device), libusb_get_device_address(device));
    libusb_device_handle* handle = nullptr;
    int failed = libusb_open(device, &handle);
    if (failed == 0) {
      failed = libusb_claim_interface(handle, kInterface);
      if (failed != 0) libusb_close(handle);
    }
    if (failed == 0)
      out.push_back(std::unique_ptr<UsbHandle>(new UsbHandle(context, handle, std::move(name))));
    else
      refusals.push_back(usb_error("open " + name, failed).message + what_to_do(failed));
  }
  libusb_free_device_list(list, 1);
  return out;
}

UsbHandle::UsbHandle(std::shared_ptr<libusb_context> context, libusb_device_handle* handle, std::string name)
    : context_(std::move(context)), handle_(handle), name_(std::move(name)) {}

UsbHandle::~UsbHandle() {
  libusb_release_interface(handle_, kInterface);
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

Result<std::size_t> UsbHandle::packet_bytes(std::uint8_t endpoint) const {
  const int bytes = libusb_get_max_packet_size(libusb_get_device(handle_), endpoint);
  if (bytes > 0) return static_cast<std::size_t>(bytes);
  return Error{ErrorCode::Unsupported, fmt::format("USB: {} has no endpoint 0x{:02x}", name_, endpoint)};
}

}  // namespace hueline::drivers
