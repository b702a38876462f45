#include "drivers/pps/socket_pps.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "drivers/pps/pps_packet.hpp"
#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {

namespace {

constexpr int kWaitMs = 100;

}  // namespace

Status SocketPps::open() {
  close();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof(address.sun_path))
    return Error{ErrorCode::Invalid, fmt::format("socket path too long: {}", path_)};
  std::memcpy(address.sun_path, path_.data(), path_.size());
  fd_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) return io_error("socket for " + path_, errno);
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    close();
    return Error{ErrorCode::Unavailable, fmt::format("connect to PPS socket {}: {}", path_, std::strerror(error))};
  }
  return {};
}

Result<Packet> SocketPps::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (fd_ < 0) return Error{ErrorCode::Disconnected, fmt::format("PPS socket {} is not open", path_)};
  pollfd readable{fd_, POLLIN, 0};
  if (::poll(&readable, 1, kWaitMs) <= 0) return Error{ErrorCode::TimedOut, {}};
  // One byte more than an edge has, so that a message that is too long is recognised.
  std::array<std::byte, kPpsPacketSize + 1> bytes;
  const ssize_t size = ::recv(fd_, bytes.data(), bytes.size(), 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return Error{ErrorCode::TimedOut, {}};
  if (size <= 0) {
    const std::string why = size == 0 ? "peer hung up" : std::strerror(errno);
    close();
    return Error{ErrorCode::Disconnected, fmt::format("PPS socket {}: {}", path_, why)};
  }
  const std::span<const std::byte> message(bytes.data(), static_cast<std::size_t>(size));
  Packet packet{kSystemSensor, PacketKind::Wire, false, 0, host_now(), Buffer::copy_of(message)};
  if (const auto edge = decode_pps(message)) packet.received = edge->time;
  return packet;
}

void SocketPps::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

}  // namespace hueline::drivers
