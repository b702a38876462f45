#include "drivers/ladybug/ladybug_usb_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "drivers/guest/guest_side.hpp"
#include "drivers/ladybug/ladybug_assembler.hpp"
#include "drivers/ladybug/ladybug_registers.hpp"
#include "drivers/little_endian.hpp"
#include "drivers/transport/usb_handle.hpp"
#include "drivers/transport/usb_packet_stream.hpp"

namespace hueline::drivers {
namespace {

constexpr std::uint16_t kPointGrey = 0x1E10;
constexpr std::uint8_t kImages = 0x81;
constexpr std::size_t kTransferBytes = 256u << 10;

/// USB3 Vision cameras of the same maker are `driver: genicam`.
std::vector<std::uint8_t> interfaces_of(const UsbHandle::Found& found) {
  if (found.vendor != kPointGrey || found.interfaces.empty()) return {};
  const UsbHandle::Interface& first = found.interfaces.front();
  if (first.is_usb3_vision()) return {};
  if (std::ranges::find(first.endpoints, kImages) == first.endpoints.end()) return {};
  return {first.number};
}

/// The registers of a camera on USB: 16 bits of the address each in wValue and wIndex, the rest chooses the request;
/// values are little endian.
class UsbRegisters final : public RegisterAccess {
 public:
  explicit UsbRegisters(UsbHandle& handle) : handle_(handle) {}

  Result<std::uint32_t> read(std::uint64_t address) override {
    std::array<std::byte, 4> bytes{};
    const Status read = handle_.read_vendor(kRequest, static_cast<std::uint16_t>(address & 0xFFFFU),
                                            static_cast<std::uint16_t>(address >> 16U & 0xFFFFU), bytes);
    if (!read) return read.error();
    return get_little<std::uint32_t>(bytes, 0);
  }
  Status write(std::uint64_t address, std::uint32_t value) override {
    std::array<std::byte, 4> bytes{};
    put_little(bytes, 0, value);
    return handle_.write_vendor(kRequest, static_cast<std::uint16_t>(address & 0xFFFFU),
                                static_cast<std::uint16_t>(address >> 16U & 0xFFFFU), bytes);
  }

 private:
  static constexpr std::uint8_t kRequest = 0x7F;  // for addresses that begin with 0xFFFF, as all used here do
  UsbHandle& handle_;
};

/// Returns the camera with that serial number, or the only one.
Result<std::unique_ptr<UsbHandle>> find_camera(std::uint32_t serial) {
  std::vector<std::string> refusals;
  auto found = UsbHandle::open_all({interfaces_of, {}}, refusals);
  if (!found) return found.error();
  std::string serials;
  std::vector<std::unique_ptr<UsbHandle>> wanted;
  for (auto& handle : *found) {
    UsbRegisters registers(*handle);
    const auto has = read_serial(registers);
    if (!has) {
      refusals.push_back(has.error().message);
      continue;
    }
    serials += fmt::format("{}{}", serials.empty() ? "" : ", ", *has);
    if (serial == 0 || *has == serial) wanted.push_back(std::move(handle));
  }
  if (wanted.size() == 1) return std::move(wanted.front());
  const auto unavailable = [](std::string why) { return Error{ErrorCode::Unavailable, "camera: " + std::move(why)}; };
  if (wanted.size() > 1)
    return unavailable(fmt::format("several are on USB: name one of the serial numbers {} in the rig", serials));
  if (!serials.empty())
    return unavailable(fmt::format("none on USB has the serial number {}; there are {}{}{}", serial, serials,
                                   refusals.empty() ? "" : "; ", fmt::join(refusals, "; ")));
  if (!refusals.empty()) return unavailable(fmt::format("{}", fmt::join(refusals, "; ")));
  return unavailable(fmt::format("no Ladybug is on USB (maker {:04x}); is it plugged in and switched on?", kPointGrey));
}

/// Returns the sizes of the transfers of one image: the last one ends where the image's buffer does.
std::vector<std::size_t> sizes_for(std::size_t image_bytes, std::size_t packet_bytes) {
  std::vector<std::size_t> out(image_bytes / kTransferBytes, kTransferBytes);
  const std::size_t rest = image_bytes % kTransferBytes;
  if (rest > 0) out.push_back((rest + packet_bytes - 1) / packet_bytes * packet_bytes);
  return out;
}

}  // namespace

struct LadybugUsbSource::Open {
  Open(std::unique_ptr<UsbHandle> camera, std::size_t packet_bytes, std::size_t image_bytes, PacketMemory& memory)
      : handle(std::move(camera)), assembler(packet_bytes, image_bytes, memory) {}

  std::unique_ptr<UsbHandle> handle;
  UsbRegisters registers{*handle};
  LadybugAssembler assembler;
  std::unique_ptr<UsbPacketStream> stream;
};

LadybugUsbSource::LadybugUsbSource(LadybugSettings settings, std::shared_ptr<PacketMemory> memory)
    : settings_(std::move(settings)), memory_(std::move(memory)) {}

LadybugUsbSource::~LadybugUsbSource() { close(); }

Status LadybugUsbSource::open() {
  close();
  auto handle = find_camera(settings_.serial);
  if (!handle) return handle.error();
  const auto packet_bytes = (*handle)->packet_bytes(kImages);
  if (!packet_bytes) return packet_bytes.error();
  UsbRegisters registers(**handle);
  const auto image_bytes = set_up(registers, settings_);
  if (!image_bytes) return image_bytes.error();
  if (Status prepared = memory_->prepare(*image_bytes); !prepared) return prepared;

  auto made = std::make_unique<Open>(std::move(*handle), *packet_bytes, *image_bytes, *memory_);
  auto stream =
      UsbPacketStream::start(*made->handle,
                             {.endpoint = kImages,
                              .transfer_bytes = sizes_for(*image_bytes, *packet_bytes),
                              .memory_bytes = std::size_t{settings_.transfer_MB} << 20U},
                             made->assembler, settings_.trigger_pin ? 0 : settings_.frame_rate_hz, settings_.exposure);
  if (!stream) return stream.error();
  made->stream = std::move(*stream);
  if (Status started = set_streaming(made->registers, true); !started) return started;
  open_ = std::move(made);
  return {};
}

Result<Packet> LadybugUsbSource::next(std::stop_token stop) {
  if (!open_) return Error{ErrorCode::Disconnected, "camera: not open"};
  return open_->stream->next(stop);
}

void LadybugUsbSource::close() {
  if (!open_) return;
  // A camera that is gone cannot be told to stop.
  (void)set_streaming(open_->registers, false);
  open_.reset();
}

Result<std::unique_ptr<PacketSource>> make_ladybug_guest(guest::HostLink& link) {
  auto settings = LadybugSettings::from_text(link.config().text);
  if (!settings) return settings.error();
  if (std::string problem = settings->validate(); !problem.empty())
    return Error{ErrorCode::Invalid, std::move(problem)};
  return std::unique_ptr<PacketSource>(std::make_unique<LadybugUsbSource>(std::move(*settings), link.memory()));
}

}  // namespace hueline::drivers
