#include "sim/devices/can_sender.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "sim/wire/can_encode.hpp"

namespace hueline::sim {

std::string CanSender::Config::validate() const {
  if (interface.size() >= IFNAMSIZ)
    return fmt::format("interface: '{}' has more than {} characters", interface, IFNAMSIZ - 1);
  if (interface.empty() && !ipv4_address(host, 0)) return fmt::format("host: '{}' is not an IPv4 address", host);
  if (interface.empty() && port == 0) return "port: 1 .. 65535";
  return {};
}

Result<std::unique_ptr<CanSender>> CanSender::open(const Config& config) {
  if (std::string problem = config.validate(); !problem.empty()) return Error{ErrorCode::Invalid, std::move(problem)};
  auto sender = std::make_unique<CanSender>();
  sender->is_gateway_ = config.interface.empty();
  if (sender->is_gateway_) {
    sender->socket_ = FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (!sender->socket_) return io_error("open a UDP socket", errno);
    sender->address_ = *ipv4_address(config.host, config.port);
    return sender;
  }
  sender->socket_ = FileDescriptor(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
  if (!sender->socket_) return io_error("open a CAN socket", errno);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(config.interface.c_str()));
  if (address.can_ifindex == 0) return io_error("find the CAN interface " + config.interface, errno);
  if (::bind(sender->socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    return io_error("send on " + config.interface, errno);
  return sender;
}

bool CanSender::send(std::span<const std::byte> frame) {
  if (!is_gateway_) return ::write(socket_.get(), frame.data(), frame.size()) == static_cast<ssize_t>(frame.size());
  const Bytes datagram = encode_cannelloni(frame, sequence_++);
  return ::sendto(socket_.get(), datagram.data(), datagram.size(), MSG_NOSIGNAL,
                  reinterpret_cast<const sockaddr*>(&address_),
                  sizeof(address_)) == static_cast<ssize_t>(datagram.size());
}

}  // namespace hueline::sim
