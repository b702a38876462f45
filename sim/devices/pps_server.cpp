#include "sim/devices/pps_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "sim/wire/little_endian.hpp"

namespace hueline::sim {

std::string PpsServer::Config::validate() const {
  if (path.empty() || path.size() >= sizeof(sockaddr_un::sun_path)) {
    return fmt::format("path: '{}' must have 1 .. {} characters", path, sizeof(sockaddr_un::sun_path) - 1);
  }
  return {};
}

Result<std::unique_ptr<PpsServer>> PpsServer::open(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  auto server = std::make_unique<PpsServer>(config);
  struct stat there {};
  if (::lstat(config.path.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode)) {
      return Error{ErrorCode::Invalid, fmt::format("{} exists and is not a socket", config.path)};
    }
    ::unlink(config.path.c_str());
  }
  FileDescriptor listener(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!listener) return io_error("open a local socket", errno);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, config.path.c_str(), config.path.size());
  if (::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return io_error(fmt::format("listen on {}", config.path), errno);
  }
  server->listener_ = std::move(listener);
  if (::listen(server->listener_.get(), 8) != 0) return io_error(fmt::format("listen on {}", config.path), errno);
  Result<FileDescriptor> event = make_wake_event();
  if (!event) return event.error();
  server->wake_ = std::move(event).value();
  server->thread_ = std::jthread([s = server.get()](const std::stop_token& stop) { s->run(stop); });
  return server;
}

PpsServer::~PpsServer() {
  if (!listener_) return;
  thread_.request_stop();
  wake(wake_);
  ::unlink(config_.path.c_str());
}

int PpsServer::publish(std::uint64_t sequence, std::int64_t edge_monotonic_raw_ns) {
  LittleEndianWriter message(24);
  message.put(std::uint32_t{0x31535050});
  message.put(std::uint32_t{1});
  message.put(sequence);
  message.put(edge_monotonic_raw_ns);
  int refused = 0;
  Lock lock(mutex_);
  for (const FileDescriptor& client : clients_) {
    const ssize_t sent = ::send(client.get(), message.bytes().data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent != static_cast<ssize_t>(message.size())) ++refused;
  }
  return refused;
}

int PpsServer::clients() const {
  Lock lock(mutex_);
  return static_cast<int>(clients_.size());
}

/// Accepts clients and removes those that hung up. Clients send nothing.
void PpsServer::run(const std::stop_token& stop) {
  std::vector<pollfd> waiting;
  while (!stop.stop_requested()) {
    waiting.assign({{listener_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}});
    {
      Lock lock(mutex_);
      for (const FileDescriptor& client : clients_) waiting.push_back({client.get(), POLLIN, 0});
    }
    if (::poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return;
    if ((waiting[1].revents & POLLIN) != 0) clear_wake(wake_);

    Lock lock(mutex_);
    for (std::size_t i = waiting.size(); i-- > 2;) {
      char ignored[64];
      if (waiting[i].revents == 0 || ::recv(waiting[i].fd, ignored, sizeof(ignored), MSG_DONTWAIT) > 0) continue;
      clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i - 2));
    }
    if ((waiting[0].revents & POLLIN) != 0) {
      FileDescriptor client(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (client) clients_.push_back(std::move(client));
    }
  }
}

}  // namespace hueline::sim
