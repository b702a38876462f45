#include "sim/devices/gige_camera.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "sim/devices/drive_clock.hpp"
#include "sim/devices/network_interface.hpp"

namespace hueline::sim {
namespace {

constexpr std::uint16_t kGvcpPort = 3956;
constexpr int kControlPollMs = 200;
constexpr std::uint32_t kPacketSizeMask = 0xffff, kDoNotFragmentBit = 1U << 30U;

Result<FileDescriptor> udp_socket(const in_addr& address, std::uint16_t port, bool is_shared) {
  FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket) return io_error("open a UDP socket", errno);
  const int on = 1;
  if (is_shared) ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  sockaddr_in local{};
  local.sin_family = AF_INET;
  local.sin_addr = address;
  local.sin_port = htons(port);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&local), sizeof(local)) != 0) {
    Error error = io_error(fmt::format("bind the camera's UDP port {}", port), errno);
    error.code = ErrorCode::Unavailable;
    return error;
  }
  return socket;
}

}  // namespace

std::string GigeCamera::Config::validate() const {
  CameraRegisters::Config registers;
  registers.serial = serial;
  registers.width = width;
  registers.height = height;
  registers.pixel_format = pixel_format;
  registers.max_packet_bytes = max_packet_bytes;
  if (std::string problem = registers.validate(); !problem.empty()) return problem;
  if (std::string problem = stream.validate(); !problem.empty()) return "stream." + problem;
  return {};
}

Result<std::unique_ptr<GigeCamera>> GigeCamera::open(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  const Result<InterfaceAddress> address = find_interface(config.interface);
  if (!address) return address.error();

  CameraRegisters::Config registers;
  registers.serial = config.serial;
  registers.width = config.width;
  registers.height = config.height;
  registers.pixel_format = config.pixel_format;
  registers.max_packet_bytes = config.max_packet_bytes;
  registers.reports_exposure = config.reports_exposure;
  registers.ipv4 = ntohl(address->own.s_addr);
  auto memory = CameraRegisters::create(registers);
  if (!memory) return memory.error();

  auto camera = std::make_unique<GigeCamera>(config);
  camera->control_ = std::make_unique<GvcpControl>(std::move(memory).value());
  Result<FileDescriptor> control = udp_socket(address->own, kGvcpPort, false);
  if (!control) return control.error();
  camera->control_socket_ = std::move(control).value();
  Result<FileDescriptor> stream = udp_socket(address->own, 0, false);
  if (!stream) return stream.error();
  camera->stream_ = std::make_unique<GvspStream>(config.stream, std::move(stream).value());
  // Discovery by broadcast is optional: without these two sockets a client still finds the camera by its address.
  if (auto global = udp_socket({htonl(INADDR_BROADCAST)}, kGvcpPort, true); global.ok()) {
    camera->global_discovery_socket_ = std::move(global).value();
  }
  if (auto subnet = udp_socket(address->broadcast, kGvcpPort, true); subnet.ok()) {
    camera->subnet_discovery_socket_ = std::move(subnet).value();
  }
  Result<FileDescriptor> event = make_wake_event();
  if (!event) return event.error();
  camera->wake_ = std::move(event).value();
  camera->thread_ = std::jthread([c = camera.get()](const std::stop_token& stop) { c->run(stop); });
  return camera;
}

GigeCamera::~GigeCamera() {
  thread_.request_stop();
  wake(wake_);
}

void GigeCamera::run(const std::stop_token& stop) {
  const FileDescriptor* sockets[] = {&control_socket_, &global_discovery_socket_, &subnet_discovery_socket_};
  std::array<pollfd, 4> waiting{};
  for (std::size_t i = 0; i < 3; ++i) waiting[i] = {sockets[i]->get(), POLLIN, 0};
  waiting[3] = {wake_.get(), POLLIN, 0};
  while (!stop.stop_requested()) {
    if (::poll(waiting.data(), waiting.size(), kControlPollMs) < 0 && errno != EINTR) return;
    for (std::size_t i = 0; i < 3; ++i) {
      if ((waiting[i].revents & POLLIN) != 0) receive(*sockets[i]);
    }
    if (control_->check_heartbeat(monotonic_raw_ns())) follow_registers();
  }
}

void GigeCamera::receive(const FileDescriptor& socket) {
  std::array<std::byte, 2048> buffer;
  sockaddr_in from{};
  socklen_t from_size = sizeof(from);
  const ssize_t n = ::recvfrom(socket.get(), buffer.data(), buffer.size(), MSG_DONTWAIT,
                               reinterpret_cast<sockaddr*>(&from), &from_size);
  if (n <= 0) return;
  const GvcpOutcome outcome =
      control_->handle(std::span(buffer).first(static_cast<std::size_t>(n)), from, monotonic_raw_ns());
  if (!outcome.has_resend) follow_registers();
  if (outcome.is_test_packet_due) stream_->send_test_packet();
  if (outcome.has_resend) stream_->send_again(outcome.resend);
  if (!outcome.answer.empty()) {
    ::sendto(control_socket_.get(), outcome.answer.data(), outcome.answer.size(), MSG_NOSIGNAL,
             reinterpret_cast<const sockaddr*>(&from), sizeof(from));
  }
}

void GigeCamera::follow_registers() {
  namespace reg = camera_register;
  CameraRegisters& memory = control_->registers();
  StreamTarget s;
  s.is_active = control_->is_controlled() && memory.get(reg::kAcquisition) != 0;
  s.to.sin_family = AF_INET;
  s.to.sin_addr.s_addr = htonl(memory.get(reg::kStreamAddress));
  s.to.sin_port = htons(static_cast<std::uint16_t>(memory.get(reg::kStreamPort)));
  s.packet_bytes = std::clamp(memory.get(reg::kStreamPacketSize) & kPacketSizeMask, kGvspOverheadBytes + 64U,
                              config_.max_packet_bytes);
  s.packet_delay_ns = memory.get(reg::kStreamPacketDelay);  // the counter has ticks of 1 ns
  s.pixel_format = memory.get(reg::kPixelFormat);
  s.region.width = memory.get(reg::kWidth);
  s.region.height = memory.get(reg::kHeight);
  s.region.offset_x = memory.get(reg::kOffsetX);
  s.region.offset_y = memory.get(reg::kOffsetY);
  s.chunks = chunks_of([&](std::uint32_t address) { return memory.get(address); }, true);
  s.may_fragment = (memory.get(reg::kStreamPacketSize) & kDoNotFragmentBit) == 0;
  stream_->set_target(s);
}

}  // namespace hueline::sim
