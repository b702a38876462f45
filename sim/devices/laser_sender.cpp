#include "sim/devices/laser_sender.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

namespace hueline::sim {

std::string LaserSender::Config::validate() const {
  if (!ipv4_address(host, 0)) return fmt::format("host: '{}' is not an IPv4 address", host);
  if (!source.empty() && !ipv4_address(source, 0)) return fmt::format("source: '{}' is not an IPv4 address", source);
  if (data_port == 0 || position_port == 0) return "data_port, position_port: 1 .. 65535";
  return {};
}

Result<std::unique_ptr<LaserSender>> LaserSender::open(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  auto sender = std::make_unique<LaserSender>();
  sender->socket_ = FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!sender->socket_) return io_error("open a UDP socket", errno);
  const int on = 1;
  if (::setsockopt(sender->socket_.get(), SOL_SOCKET, SO_BROADCAST, &on, sizeof(on)) != 0) {
    return io_error("allow broadcasts on a UDP socket", errno);
  }
  if (!config.source.empty()) {
    const sockaddr_in from = *ipv4_address(config.source, 0);
    if (::bind(sender->socket_.get(), reinterpret_cast<const sockaddr*>(&from), sizeof(from)) != 0) {
      return io_error(fmt::format("bind a UDP socket to {}", config.source), errno);
    }
  }
  sender->data_address_ = *ipv4_address(config.host, config.data_port);
  sender->position_address_ = *ipv4_address(config.host, config.position_port);
  return sender;
}

bool LaserSender::send(std::span<const std::byte> datagram, const sockaddr_in& to) {
  return ::sendto(socket_.get(), datagram.data(), datagram.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to),
                  sizeof(to)) == static_cast<ssize_t>(datagram.size());
}

}  // namespace hueline::sim
