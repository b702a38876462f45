#include "drivers/transport/byte_stream_source.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/transport/host_clock.hpp"

namespace hueline::drivers {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kPollMs = 100;

/// Returns whether `error` (an errno) means that the device or its cable is gone. Other errors are the system's own.
bool is_gone(int error) {
  switch (error) {
    case EIO:
    case ENODEV:
    case ENXIO:
    case EPIPE:
    case ECONNRESET:
    case ETIMEDOUT:
    case ENETDOWN:
    case ENETUNREACH:
    case EHOSTUNREACH:
    case EHOSTDOWN:
    case ECONNABORTED:
      return true;
    default:
      return false;
  }
}

}  // namespace

std::string ByteStreamSource::Config::validate() const {
  if (chunk_bytes < 64 || chunk_bytes > 1048576) return "chunk_bytes must be 64 .. 1048576";
  if (write_timeout.count() < 10 || write_timeout.count() > 60000) return "write_timeout must be 10 .. 60000 ms";
  return {};
}

ByteStreamSource::~ByteStreamSource() { ByteStreamSource::close(); }

Status ByteStreamSource::open() {
  close();
  Result<int> connected = connect();
  if (!connected.ok()) return connected.error();
  fd_ = *connected;
  chunk_.resize(config_.chunk_bytes);
  const Status sent = send_dialogue();
  if (!sent.ok()) close();
  return sent;
}

Status ByteStreamSource::send_dialogue() {
  const auto deadline = Clock::now() + config_.write_timeout;
  std::string_view rest = config_.dialogue;
  while (!rest.empty()) {
    pollfd ready{fd_, POLLOUT, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0)
      return Error{ErrorCode::Unavailable, fmt::format("{}: took only {} of {} bytes of the start-up dialogue in {} ms",
                                                       name(), config_.dialogue.size() - rest.size(),
                                                       config_.dialogue.size(), config_.write_timeout.count())};
    if (::poll(&ready, 1, static_cast<int>(left)) <= 0) continue;
    ssize_t written = ::send(fd_, rest.data(), rest.size(), MSG_NOSIGNAL);
    if (written < 0 && errno == ENOTSOCK) written = ::write(fd_, rest.data(), rest.size());
    if (written >= 0) {
      rest.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EAGAIN && errno != EINTR) {
      return Error{ErrorCode::Unavailable,
                   fmt::format("{}: sending the start-up dialogue: {}", name(), std::strerror(errno))};
    }
  }
  return {};
}

Result<Packet> ByteStreamSource::next(std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (fd_ < 0) return Error{ErrorCode::Disconnected, fmt::format("{}: not open", name())};
  pollfd ready{fd_, POLLIN, 0};
  const int count = ::poll(&ready, 1, kPollMs);
  const HostTime received = host_now();
  if (count < 0 && errno != EINTR) return io_error(fmt::format("{}: poll", name()), errno);
  if (count <= 0) return Error{ErrorCode::TimedOut, fmt::format("{}: nothing came", name())};
  const ssize_t size = ::read(fd_, chunk_.data(), chunk_.size());
  if (size > 0) {
    Packet packet;
    packet.received = received;
    packet.bytes = Buffer::copy_of(std::as_bytes(std::span(chunk_).first(static_cast<std::size_t>(size))));
    return packet;
  }
  if (size == 0) return Error{ErrorCode::Disconnected, fmt::format("{}: the other side closed", name())};
  const int error = errno;
  if (error == EAGAIN || error == EINTR) {
    if (ready.revents & (POLLHUP | POLLNVAL)) return Error{ErrorCode::Disconnected, fmt::format("{}: hung up", name())};
    return Error{ErrorCode::TimedOut, fmt::format("{}: nothing came", name())};
  }
  if (is_gone(error)) return Error{ErrorCode::Disconnected, fmt::format("{}: {}", name(), std::strerror(error))};
  return io_error(fmt::format("{}: read", name()), error);
}

void ByteStreamSource::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

}  // namespace hueline::drivers
