#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/result.hpp"
#include "sim/devices/socket.hpp"

namespace hueline::sim {

/// The Ethernet side of a scanner. It sends data and position datagrams to one host without being asked. Thread safety:
/// none.
class LaserSender {
 public:
  struct Config {
    std::string host = "127.0.0.1";  ///< address of the receiver; may be a broadcast address
    std::string source;              ///< address to send from; empty: the kernel chooses
    std::uint16_t data_port = 2368;
    std::uint16_t position_port = 8308;
    std::string validate() const;
  };

  /// Opens the socket. Errors: Invalid (configuration), or what the system says of the socket.
  static Result<std::unique_ptr<LaserSender>> open(const Config& config);

  /// Send a datagram. Return false if the kernel refused it.
  bool send_data(std::span<const std::byte> datagram) { return send(datagram, data_address_); }
  bool send_position(std::span<const std::byte> datagram) { return send(datagram, position_address_); }

 private:
  bool send(std::span<const std::byte> datagram, const sockaddr_in& to);
  FileDescriptor socket_;
  sockaddr_in data_address_{}, position_address_{};
};

}  // namespace hueline::sim
