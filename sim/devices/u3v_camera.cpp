#include "sim/devices/u3v_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "sim/devices/drive_clock.hpp"

namespace hueline::sim {
namespace {

constexpr std::uint32_t kCommandMagic = 0x43563355;
constexpr std::uint16_t kReadCommand = 0x0800, kWriteCommand = 0x0802;
constexpr std::size_t kHeadBytes = 12, kAddressBytes = 8, kReadBytes = 12;
// A piece of the payload that becomes ready at once; a multiple of the packet size.
constexpr std::size_t kPieceBytes = 64 * UsbPort::kPacketBytes;

template <class T>
T get_le(std::span<const std::byte> bytes, std::size_t at) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<T>(value | static_cast<T>(std::to_integer<T>(bytes[at + i]) << 8U * i));
  return value;
}

U3vRegisters::Config registers_of(const U3vCamera::Config& config) {
  return {.serial = config.serial,
          .width = config.width,
          .height = config.height,
          .pixel_format = config.pixel_format,
          .response_ms = config.response_ms,
          .reports_exposure = config.reports_exposure};
}

}  // namespace

std::string U3vCamera::Config::validate() const {
  if (!(link_bytes_per_second >= 0))
    return fmt::format("link_bytes_per_second: {} is not 0 or more", link_bytes_per_second);
  if (start_takes_ms > 5000) return fmt::format("start_takes_ms: {} is not within 0 .. 5000", start_takes_ms);
  return registers_of(*this).validate();
}

Result<std::unique_ptr<U3vCamera>> U3vCamera::make(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  return std::unique_ptr<U3vCamera>(new U3vCamera(config));
}

std::string u3v_guid(const std::string& serial) {
  return fmt::format("FFFF{:08X}", static_cast<std::uint32_t>(std::hash<std::string>{}(serial)));
}

U3vCamera::U3vCamera(const Config& config)
    : config_(config),
      descriptors_(u3v_descriptors(kCameraMaker, kCameraModel, "1", config.serial, u3v_guid(config.serial))) {}

U3vCamera::~U3vCamera() { unplug(); }

Status U3vCamera::plug() {
  unplug();
  auto registers = U3vRegisters::create(registers_of(config_));
  if (!registers) return registers.error();
  Lock lock(mutex_);
  registers_ = std::move(registers).value();
  auto port = UsbPort::plug(*this);
  if (!port) return port.error();
  port_ = std::move(port).value();
  return {};
}

void U3vCamera::unplug() {
  std::unique_ptr<UsbPort> port;  // ended without the lock, because its thread may wait for it
  Lock lock(mutex_);
  port = std::move(port_);
  lock.unlock();
}

bool U3vCamera::is_streaming() const {
  Lock lock(mutex_);
  return port_ && port_->is_plugged() && registers_->get(camera_register::kAcquisition) != 0 &&
         (registers_->get(u3v_register::kStreamControl) & 1U) != 0;
}

std::uint32_t U3vCamera::feature(std::uint32_t address) const {
  Lock lock(mutex_);
  return registers_ ? registers_->get(address) : 0;
}

void U3vCamera::receive(std::uint8_t endpoint, std::span<const std::byte> bytes) {
  if (endpoint != kU3vControlEndpoint || bytes.size() < kHeadBytes) return;
  bool is_start = false;
  const Bytes acknowledge = obey(bytes, is_start);
  // The port outlives this call, because its own thread makes it.
  UsbPort* port = nullptr;
  {
    Lock lock(mutex_);
    port = port_.get();
  }
  if (!port) return;
  if (is_start && config_.start_takes_ms > 0) {
    const auto within_ms = static_cast<std::uint16_t>(config_.start_takes_ms + config_.response_ms);
    port->send(endpoint, Buffer::copy_of(encode_gencp_pending(get_le<std::uint16_t>(bytes, 10), within_ms)));
    std::this_thread::sleep_for(std::chrono::milliseconds(config_.start_takes_ms));
  }
  port->send(endpoint, Buffer::copy_of(acknowledge));
}

Bytes U3vCamera::obey(std::span<const std::byte> command, bool& is_start) {
  const auto number = get_le<std::uint16_t>(command, 6), size = get_le<std::uint16_t>(command, 8),
             id = get_le<std::uint16_t>(command, 10);
  const auto body = command.subspan(kHeadBytes);
  const auto say = [&](GencpStatus status, const Bytes& data = {}) {
    return encode_gencp_acknowledge(number, status, id, status == GencpStatus::Success ? data : Bytes());
  };
  if (get_le<std::uint32_t>(command, 0) != kCommandMagic || size != body.size() || size < kAddressBytes)
    return say(GencpStatus::InvalidHeader);
  const auto address = get_le<std::uint64_t>(body, 0);
  Lock lock(mutex_);
  if (number == kReadCommand) {
    if (size != kReadBytes) return say(GencpStatus::InvalidHeader);
    Bytes data(get_le<std::uint16_t>(body, 10));
    if (data.empty() || data.size() > U3vRegisters::kMostMessageBytes - kHeadBytes)
      return say(GencpStatus::InvalidParameter);
    const GencpStatus status = registers_->read(address, data);
    return say(status, data);
  }
  if (number != kWriteCommand) return say(GencpStatus::NotImplemented);
  const GencpStatus status = registers_->write(address, body.subspan(kAddressBytes));
  is_start = status == GencpStatus::Success && address == camera_register::kAcquisition &&
             registers_->get(camera_register::kAcquisition) != 0;
  if (is_start) ++acquisitions_;
  // An acquisition that ends drops the image that is on its way.
  if (port_ && status == GencpStatus::Success &&
      ((address == camera_register::kAcquisition && !is_start) ||
       (address == u3v_register::kStreamControl && (registers_->get(u3v_register::kStreamControl) & 1U) == 0)))
    port_->drop(kU3vStreamEndpoint);
  LittleEndianWriter written(4);
  written.put(std::uint16_t{0});
  written.put(static_cast<std::uint16_t>(body.size() - kAddressBytes));
  return say(status, written.take());
}

Status U3vCamera::send(const CameraImage& image, const std::stop_token& stop, U3vFault fault) {
  if (!is_streaming()) return Error{ErrorCode::Unavailable, "nobody has started the camera's acquisition"};
  U3vImage told;
  CameraRegion region;
  UsbPort* port = nullptr;
  std::uint64_t acquisition = 0;
  CameraChunks chunks;
  {
    Lock lock(mutex_);
    region = registers_->region();
    chunks = registers_->chunks();
    told.pixel_format = registers_->get(camera_register::kPixelFormat);
    port = port_.get();
    acquisition = acquisitions_;
  }
  if (!port) return Error{ErrorCode::Unavailable, "the camera is not plugged in"};
  Result<Buffer> pixels = cut_region(image, region);
  if (!pixels) return pixels.error();
  *pixels = with_chunks(*pixels, image, chunks);
  if (chunks.is_active) told.payload_type = kU3vImageWithChunks;
  if (std::exchange(numbered_acquisition_, acquisition) != acquisition) first_sequence_ = image.sequence;
  told.block_id = image.sequence - first_sequence_;
  told.timestamp_ns = static_cast<std::uint64_t>(image.counter_ns);
  told.width = image.ignores_region ? image.width : region.width;
  told.height = image.ignores_region ? image.height : region.height;
  told.offset_x = region.offset_x;
  told.offset_y = region.offset_y;

  if (fault != U3vFault::NoLeader) port->send(kU3vStreamEndpoint, Buffer::copy_of(encode_u3v_leader(told)));
  if (fault == U3vFault::Stall || fault == U3vFault::Unplug) {
    // Half of the image, in whole packets: the host's transfer goes on and waits for the rest.
    port->send(kU3vStreamEndpoint, pixels->part(0, pixels->size() / 2 / UsbPort::kPacketBytes * UsbPort::kPacketBytes));
    if (fault == U3vFault::Stall)
      port->stall(kU3vStreamEndpoint);
    else
      unplug();
    return {};
  }
  // Half an image ends in the middle of a packet.
  const Buffer payload = fault == U3vFault::ShortPayload ? pixels->part(0, pixels->size() / 2 | 1U) : *pixels;
  bool is_taken = send_payload(*port, payload, stop);
  if (is_taken && fault != U3vFault::NoTrailer) {
    port->send(kU3vStreamEndpoint, Buffer::copy_of(encode_u3v_trailer(told, payload.size())));
    is_taken = port->wait_until_taken(kU3vStreamEndpoint, stop);
  }
  if (is_taken) return {};
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped in the middle of an image"};
  return Error{ErrorCode::Unavailable, "the client has stopped, or the cable was pulled, in the middle of an image"};
}

bool U3vCamera::send_payload(UsbPort& port, const Buffer& pixels, const std::stop_token& stop) const {
  if (config_.link_bytes_per_second == 0) {
    port.send(kU3vStreamEndpoint, pixels);
    return port.wait_until_taken(kU3vStreamEndpoint, stop);
  }
  const DriveClock clock(monotonic_raw_ns(), 1.0);
  for (std::size_t at = 0; at < pixels.size(); at += kPieceBytes) {
    const std::size_t size = std::min(kPieceBytes, pixels.size() - at);
    port.send(kU3vStreamEndpoint, pixels.part(at, size));
    const double ns = static_cast<double>(at + size) / config_.link_bytes_per_second * 1e9;
    if (!clock.sleep_until(static_cast<std::int64_t>(ns), stop)) return false;
  }
  return port.wait_until_taken(kU3vStreamEndpoint, stop);
}

}  // namespace hueline::sim
