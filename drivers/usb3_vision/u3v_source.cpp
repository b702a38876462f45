#include "drivers/usb3_vision/u3v_source.hpp"

#include <fmt/format.h>
#include <libusb.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "drivers/gige/aravis_camera.hpp"
#include "drivers/gige/chunk_reader.hpp"
#include "drivers/gige/memory_device.hpp"
#include "drivers/transport/usb_handle.hpp"
#include "drivers/transport/usb_packet_stream.hpp"
#include "drivers/usb3_vision/u3v_assembler.hpp"
#include "drivers/usb3_vision/u3v_registers.hpp"

namespace hueline::drivers {
namespace {

/// The interfaces of a USB3 Vision camera, by their bInterfaceProtocol.
constexpr std::uint8_t kControl = 0x00, kStream = 0x02;

struct Endpoints {
  std::uint8_t command = 0, answer = 0, stream = 0;
};

const UsbHandle::Interface* find_interface(const UsbHandle::Found& found, std::uint8_t protocol) {
  const auto at = std::ranges::find_if(found.interfaces, [&](const UsbHandle::Interface& one) {
    return one.is_usb3_vision() && one.protocol == protocol;
  });
  return at == found.interfaces.end() ? nullptr : &*at;
}

/// Returns the endpoint of an interface in a direction, or 0.
std::uint8_t endpoint_of(const UsbHandle::Interface& interface, bool is_to_host) {
  const auto at = std::ranges::find_if(interface.endpoints,
                                       [&](std::uint8_t address) { return ((address & 0x80) != 0) == is_to_host; });
  return at == interface.endpoints.end() ? std::uint8_t{0} : *at;
}

std::optional<Endpoints> endpoints_of(const UsbHandle::Found& found) {
  const auto* control = find_interface(found, kControl);
  const auto* stream = find_interface(found, kStream);
  if (!control || !stream) return std::nullopt;
  const Endpoints out{endpoint_of(*control, false), endpoint_of(*control, true), endpoint_of(*stream, true)};
  if (out.command == 0 || out.answer == 0 || out.stream == 0) return std::nullopt;
  return out;
}

std::vector<std::uint8_t> interfaces_of(const UsbHandle::Found& found) {
  if (!endpoints_of(found)) return {};
  return {find_interface(found, kControl)->number, find_interface(found, kStream)->number};
}

/// The control channel: a bulk endpoint in each direction.
class UsbChannel final : public MessageChannel {
 public:
  UsbChannel(UsbHandle& handle, const Endpoints& endpoints) : handle_(handle), endpoints_(endpoints) {}

  Status send(std::span<const std::byte> message) override {
    std::vector<std::byte> bytes(message.begin(), message.end());  // libusb takes no const bytes
    const auto sent = handle_.bulk(endpoints_.command, bytes, std::chrono::seconds(1));
    if (!sent) return sent.error();
    return {};
  }
  Result<std::size_t> receive(std::span<std::byte> out, std::chrono::milliseconds limit) override {
    return handle_.bulk(endpoints_.answer, out, limit);
  }

 private:
  UsbHandle& handle_;
  const Endpoints endpoints_;
};

Result<std::unique_ptr<UsbHandle>> find_camera(const std::string& serial) {
  std::vector<std::string> refusals;
  auto found = UsbHandle::open_all({interfaces_of, serial}, refusals);
  if (!found) return found.error();
  if (!found->empty()) return std::move(found->front());
  if (!refusals.empty()) return Error{ErrorCode::Unavailable, fmt::format("camera: {}", fmt::join(refusals, "; "))};
  return Error{ErrorCode::Unavailable, fmt::format("serial: no USB3 Vision camera on USB has the number {}", serial)};
}

/// Says in the words of a camera's messages what went wrong. What opening again may mend is Unavailable.
Error of_camera(Error error) {
  const bool is_final = error.code == ErrorCode::Invalid || error.code == ErrorCode::Unsupported;
  if (!is_final) error.code = ErrorCode::Unavailable;
  if (error.code == ErrorCode::Unsupported) error.code = ErrorCode::Invalid;
  if (!error.message.starts_with("camera: ")) error.message = "camera: " + error.message;
  return error;
}

}  // namespace

struct U3vSource::Open {
  Open(std::unique_ptr<UsbHandle> found, const Endpoints& at)
      : handle(std::move(found)), endpoints(at), channel(*handle, at), memory(channel) {}

  const std::unique_ptr<UsbHandle> handle;
  const Endpoints endpoints;
  UsbChannel channel;
  GencpClient memory;
  U3vBootstrap bootstrap;
  GRef<ArvCamera> camera;
  std::unique_ptr<ChunkReader> chunks;  ///< null: the camera reports no exposures
  std::unique_ptr<U3vAssembler> assembler;
  std::unique_ptr<UsbPacketStream> stream;

  Status connect(const GenicamConfig& config);
  Status start(const GenicamConfig& config, PacketMemory& images);
};

/// Reads what the camera is, and sets it.
Status U3vSource::Open::connect(const GenicamConfig& config) {
  const auto read = read_bootstrap(memory);
  if (!read) return read.error();
  bootstrap = *read;
  memory.set_limits(bootstrap.limits);
  // A program that died may have left the camera streaming.
  if (Status stopped = set_streaming(memory, bootstrap.stream, false); !stopped) return stopped;
  auto description = read_description(memory, bootstrap.manifest);
  if (!description) return description.error();
  const auto device = make_memory_device(memory, std::move(*description));
  if (!device) return device.error();
  GError* error = nullptr;
  camera.reset(arv_camera_new_with_device(device->get(), &error));
  if (error) return take_error("read the description", error);
  return configure_camera(camera.get(), config);
}

Status U3vSource::Open::start(const GenicamConfig& config, PacketMemory& images) {
  const auto packet_bytes = handle->packet_bytes(endpoints.stream);
  if (!packet_bytes) return packet_bytes.error();
  auto shape = set_up_stream(memory, bootstrap.stream, *packet_bytes);
  if (!shape) return shape.error();
  if (Status prepared = images.prepare(kImageHeaderSize + shape->payload_bytes); !prepared) return prepared;
  if (config.chunks) chunks = ChunkReader::make(camera.get(), std::endian::little);
  U3vAssembler::ReadChunks read_chunks;
  if (chunks)
    read_chunks = [this](std::span<const std::byte> payload, ImageHeader& header) { chunks->read(payload, header); };
  assembler = std::make_unique<U3vAssembler>(
      U3vAssembler::Shape{*packet_bytes, shape->payload_bytes, shape->padding_bytes}, images, std::move(read_chunks));
  if (Status enabled = set_streaming(memory, bootstrap.stream, true); !enabled) return enabled;
  auto started = UsbPacketStream::start(*handle,
                                        {.endpoint = endpoints.stream,
                                         .transfer_bytes = std::move(shape->transfer_bytes),
                                         .memory_bytes = std::size_t{config.transfer_MB} << 20U},
                                        *assembler, config.trigger_source.empty() ? config.frame_rate_hz : 0,
                                        config.exposure.value_or(nanoseconds(0)));
  if (!started) return started.error();
  stream = std::move(*started);
  GError* error = nullptr;
  arv_camera_start_acquisition(camera.get(), &error);
  if (error) return take_error("start the acquisition", error);
  return {};
}

U3vSource::U3vSource(GenicamConfig config, std::string serial, std::shared_ptr<PacketMemory> memory)
    : config_(std::move(config)), serial_(std::move(serial)), memory_(std::move(memory)) {}

U3vSource::~U3vSource() { close(); }

Status U3vSource::open() {
  close();
  auto handle = find_camera(serial_);
  if (!handle) return handle.error();
  const auto endpoints = endpoints_of((*handle)->found());
  if (!endpoints) return Error{ErrorCode::Invalid, "camera: it has no endpoints for commands and images"};
  auto made = std::make_unique<Open>(std::move(*handle), *endpoints);
  if (const Status connected = made->connect(config_); !connected) return of_camera(connected.error());
  if (const Status started = made->start(config_, *memory_); !started) return of_camera(started.error());
  ::pthread_setname_np(::pthread_self(), "camera-receive");
  if (config_.realtime_priority > 0) arv_make_thread_realtime(config_.realtime_priority);
  open_ = std::move(made);
  return {};
}

Result<Packet> U3vSource::next(std::stop_token stop) {
  if (!open_) return Error{ErrorCode::Disconnected, "camera: not open"};
  return open_->stream->next(stop);
}

void U3vSource::close() {
  if (!open_) return;
  // A camera that is gone cannot be told to stop.
  arv_camera_stop_acquisition(open_->camera.get(), nullptr);
  (void)set_streaming(open_->memory, open_->bootstrap.stream, false);
  open_.reset();
}

bool is_u3v_on_usb(const std::string& serial) {
  const auto line_of = [](const std::filesystem::path& file) {
    std::string line;
    std::getline(std::ifstream(file), line);
    return line;
  };
  std::error_code failed;
  for (std::filesystem::directory_iterator i("/sys/bus/usb/devices", failed), end; !failed && i != end;
       i.increment(failed)) {
    if (line_of(i->path() / "serial") != serial) continue;
    // The interfaces of a device are folders in it, such as 2-1:1.0.
    std::error_code unread;
    for (std::filesystem::directory_iterator k(i->path(), unread), last; !unread && k != last; k.increment(unread))
      if (line_of(k->path() / "bInterfaceClass") == "ef" && line_of(k->path() / "bInterfaceSubClass") == "05")
        return true;
  }
  return false;
}

}  // namespace hueline::drivers
