#include "sim/devices/ladybug_camera.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "sim/wire/little_endian.hpp"

namespace hueline::sim {
namespace {

constexpr std::uint8_t kImages = 1;        // endpoint 0x81
constexpr std::uint8_t kRegisters = 0x7F;  // bRequest, for addresses that begin with 0xFFFF

/// A SuperSpeed device with one interface of its maker's class and one bulk endpoint.
UsbDescriptors describe(std::uint16_t product) {
  LittleEndianWriter device(18), configuration(40), capabilities(22);
  device.put_bytes({18, 1, 0x00, 0x03, 0, 0, 0, 9});
  device.put(std::uint16_t{0x1E10});
  device.put(product);
  device.put_bytes({0x00, 0x01, 1, 2, 0, 1});
  configuration.put_bytes({9, 2, 31, 0, 1, 1, 0, 0x80, 112});  // 112 times 8 mA from the bus
  configuration.put_bytes({9, 4, 0, 0, 1, 0xFF, 0xFF, 0xFF, 0});
  configuration.put_bytes({7, 5, 0x80 | kImages, 2});
  configuration.put(static_cast<std::uint16_t>(UsbPort::kPacketBytes));
  configuration.put_bytes({0, 6, 0x30, 15, 0, 0, 0});
  capabilities.put_bytes({5, 15, 22, 0, 2});
  capabilities.put_bytes({7, 16, 2, 0, 0, 0, 0});
  capabilities.put_bytes({10, 16, 3, 0, 0x0E, 0, 1, 0, 0, 0});
  return {device.take(), configuration.take(), capabilities.take(), {"hueline", "Ladybug"}};
}

}  // namespace

LadybugCamera::LadybugCamera(const Config& config)
    : config_(config), descriptors_(describe(config.product)), registers_(config.serial) {}

LadybugCamera::~LadybugCamera() { unplug(); }

Status LadybugCamera::plug() {
  unplug();
  Lock lock(mutex_);
  registers_ = LadybugRegisters(config_.serial);
  auto port = UsbPort::plug(*this);
  if (!port) return port.error();
  port_ = std::move(port).value();
  return {};
}

void LadybugCamera::unplug() {
  std::unique_ptr<UsbPort> port;  // ended without the lock, because its thread may wait for it
  Lock lock(mutex_);
  port = std::move(port_);
  lock.unlock();
}

bool LadybugCamera::is_streaming() const {
  Lock lock(mutex_);
  return port_ && port_->is_plugged() && registers_.is_streaming();
}

std::uint32_t LadybugCamera::get(std::uint32_t address) const {
  Lock lock(mutex_);
  return registers_.get(address);
}

float LadybugCamera::get_float(std::uint32_t address) const {
  Lock lock(mutex_);
  return registers_.get_float(address);
}

Result<Bytes> LadybugCamera::answer(const UsbVendorRequest& request) {
  const Error refused{ErrorCode::Unsupported, "the camera has no such register"};
  if (request.number != kRegisters) return refused;
  const std::uint32_t address = std::uint32_t{request.index} << 16U | request.value;
  Lock lock(mutex_);
  if (request.is_read) {
    Bytes out;
    // A host may read several registers at once; the port cuts what it did not ask for.
    for (std::uint32_t at = address; out.size() < 64; at += 4) {
      const auto value = registers_.read(at);
      if (!value) break;
      for (std::uint32_t i = 0; i < 4; ++i) out.push_back(static_cast<std::byte>(*value >> 8U * i));
    }
    if (out.empty()) return refused;
    return out;
  }
  if (request.data.size() != 4) return refused;
  std::uint32_t value = 0;
  for (std::uint32_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(request.data[i]) << 8U * i;
  if (!registers_.write(address, value)) return refused;
  // A stream that ends drops the image that is on its way.
  if (port_ && address == ladybug_register::kStream && !registers_.is_streaming()) port_->drop(kImages);
  return Bytes();
}

Status LadybugCamera::send(const Buffer& image, const std::stop_token& stop, LadybugFault fault) {
  if (!is_streaming()) return Error{ErrorCode::Unavailable, "nobody has started the camera's stream"};
  UsbPort* port = nullptr;
  std::size_t room = 0;
  {
    Lock lock(mutex_);
    port = port_.get();
    room = registers_.image_bytes();
  }
  if (port->is_halted(kImages)) return Error{ErrorCode::Unavailable, "the endpoint is halted"};
  if (image.size() > room) return Error{ErrorCode::Invalid, "the image is larger than the camera's buffer"};
  constexpr std::size_t kPacket = UsbPort::kPacketBytes;
  const auto send_zeros = [&](std::size_t bytes) { port->send(kImages, Buffer::copy_of(Bytes(bytes))); };
  const std::size_t half = image.size() / 2 / kPacket * kPacket;
  switch (fault) {
    case LadybugFault::Stall:
      port->send(kImages, image.part(0, half));
      port->stall(kImages);
      return {};
    case LadybugFault::Unplug:
      port->send(kImages, image.part(0, half));
      unplug();
      return {};
    case LadybugFault::Short:
      port->send(kImages, image.part(0, half + 1));
      break;
    case LadybugFault::Strange:
      send_zeros(half + 1);
      break;
    case LadybugFault::None: {
      const bool is_in_packets = image.size() % kPacket == 0;
      std::size_t padding = config_.sends_whole_buffer ? room - image.size() : is_in_packets ? 1 : 0;
      if (padding == 0) {
        port->send(kImages, image);
        break;
      }
      // One piece, because a piece that is no whole number of packets ends with a short one.
      Bytes whole(image.size() + padding);
      std::ranges::copy(image.bytes(), whole.begin());
      port->send(kImages, Buffer::copy_of(whole));
    }
  }
  if (port->wait_until_taken(kImages, stop)) return {};
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped in the middle of an image"};
  return Error{ErrorCode::Unavailable, "the client has stopped, or the cable was pulled, in the middle of an image"};
}

}  // namespace hueline::sim
