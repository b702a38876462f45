#include "sim/devices/pos_server.hpp"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace hueline::sim {
namespace {

constexpr std::size_t kLongestCommand = 1024;

}  // namespace

std::string PosServer::Config::validate() const {
  if (!ipv4_address(address, 0)) return fmt::format("address: '{}' is not an IPv4 address", address);
  if (client_buffer_bytes < 4096) return fmt::format("client_buffer_bytes: {} is below 4096", client_buffer_bytes);
  return {};
}

Result<std::unique_ptr<PosServer>> PosServer::open(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  auto server = std::make_unique<PosServer>(config);
  server->listener_ = FileDescriptor(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!server->listener_) return io_error("open a TCP socket", errno);
  const int on = 1;
  ::setsockopt(server->listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  const sockaddr_in address = *ipv4_address(config.address, config.port);
  if (::bind(server->listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(server->listener_.get(), 16) != 0) {
    return io_error(fmt::format("listen on TCP {}:{}", config.address, config.port), errno);
  }
  Result<FileDescriptor> event = make_wake_event();
  if (!event) return event.error();
  server->wake_ = std::move(event).value();
  server->thread_ = std::jthread([s = server.get()](const std::stop_token& stop) { s->run(stop); });
  return server;
}

PosServer::~PosServer() {
  thread_.request_stop();
  wake(wake_);
}

void PosServer::publish(std::span<const std::byte> log, const NovatelPeek& what, std::size_t piece_bytes) {
  const std::span<const char> bytes(reinterpret_cast<const char*>(log.data()), log.size());
  Lock lock(mutex_);
  bool is_wanted = false;
  for (const auto& client : clients_) {
    const bool wants = what.id == 0 ? !client->subscriptions.empty() : client->subscriptions.wants(what);
    if (client->is_gone || !wants) continue;
    is_wanted = true;
    if (client->unsent.size() + bytes.size() > config_.client_buffer_bytes) {
      ++counts_.logs_dropped;
      continue;
    }
    ++counts_.logs_sent;
    const std::size_t piece = piece_bytes > 0 ? piece_bytes : bytes.size();
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      send(*client, bytes.subspan(at, std::min(piece, bytes.size() - at)));
  }
  if (!is_wanted) ++counts_.logs_unwanted;
}

int PosServer::listening_clients() const {
  Lock lock(mutex_);
  return static_cast<int>(std::count_if(clients_.begin(), clients_.end(),
                                        [](const auto& c) { return !c->is_gone && !c->subscriptions.empty(); }));
}

PosServer::Counts PosServer::counts() const {
  Lock lock(mutex_);
  return counts_;
}

bool PosServer::is_drained() const {
  Lock lock(mutex_);
  return std::all_of(clients_.begin(), clients_.end(), [](const auto& c) { return c->is_gone || c->unsent.empty(); });
}

/// Call it with the mutex held. The thread sends later what the kernel does not accept at once.
void PosServer::send(Client& client, std::span<const char> bytes) {
  const bool was_empty = client.unsent.empty();
  client.unsent.insert(client.unsent.end(), bytes.begin(), bytes.end());
  if (!was_empty) return;
  flush(client);
  if (!client.unsent.empty()) wake(wake_);
}

void PosServer::flush(Client& client) {
  std::size_t sent = 0;
  while (sent < client.unsent.size()) {
    const ssize_t n = ::send(client.socket.get(), client.unsent.data() + sent, client.unsent.size() - sent,
                             MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0) {
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) client.is_gone = true;
      break;
    }
    sent += static_cast<std::size_t>(n);
  }
  client.unsent.erase(client.unsent.begin(), client.unsent.begin() + static_cast<std::ptrdiff_t>(sent));
}

void PosServer::accept_client() {
  FileDescriptor socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!socket) return;
  const int on = 1;
  ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  auto client = std::make_unique<Client>();
  client->socket = std::move(socket);
  for (const std::string& command : config_.saved_commands) (void)client->subscriptions.execute(command);
  clients_.push_back(std::move(client));
}

void PosServer::read_commands(Client& client) {
  char buffer[512];
  const ssize_t n = ::recv(client.socket.get(), buffer, sizeof(buffer), MSG_DONTWAIT);
  if (n == 0 || (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) client.is_gone = true;
  for (ssize_t i = 0; i < n; ++i) {
    if (buffer[i] != '\r' && buffer[i] != '\n') {
      if (client.command.size() < kLongestCommand) client.command += buffer[i];
      continue;
    }
    const std::string answer = client.subscriptions.execute(client.command);
    client.command.clear();
    send(client, answer);
  }
}

void PosServer::run(const std::stop_token& stop) {
  std::vector<pollfd> waiting;
  while (!stop.stop_requested()) {
    waiting.assign({{listener_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}});
    {
      Lock lock(mutex_);
      std::erase_if(clients_, [](const auto& c) { return c->is_gone; });
      for (const auto& client : clients_) {
        const auto events = static_cast<short>(client->unsent.empty() ? POLLIN : POLLIN | POLLOUT);
        waiting.push_back({client->socket.get(), events, 0});
      }
    }
    if (::poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return;
    if ((waiting[1].revents & POLLIN) != 0) clear_wake(wake_);

    Lock lock(mutex_);
    for (std::size_t i = 2; i < waiting.size(); ++i) {  // only this thread adds and removes clients
      Client& client = *clients_[i - 2];
      if ((waiting[i].revents & POLLOUT) != 0) flush(client);
      if ((waiting[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0) read_commands(client);
    }
    if ((waiting[0].revents & POLLIN) != 0) accept_client();
  }
}

}  // namespace hueline::sim
