#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/result.hpp"
#include "sim/devices/socket.hpp"

namespace hueline::sim {

/// The vehicle's CAN bus. It sends on a CAN interface of this computer (vcan, vxcan), or, where the kernel has no CAN,
/// datagrams as a CAN-to-Ethernet gateway does (cannelloni). Thread safety: none.
class CanSender {
 public:
  struct Config {
    std::string interface;  ///< CAN interface to send on; empty: send datagrams to `host`
    std::string host = "127.0.0.1";
    std::uint16_t port = 20000;  ///< the usual port of cannelloni
    std::string validate() const;
  };

  /// Opens the socket. Errors: Invalid (configuration), or what the system says of the socket or interface.
  static Result<std::unique_ptr<CanSender>> open(const Config& config);

  /// Sends a struct can_frame. Returns false if the kernel refused it.
  bool send(std::span<const std::byte> frame);

 private:
  FileDescriptor socket_;
  sockaddr_in address_{};
  bool is_gateway_ = true;
  std::uint8_t sequence_ = 0;
};

}  // namespace hueline::sim
