#pragma once

#include <string>
#include <utility>

#include "core/packet.hpp"

namespace hueline::drivers {

/// Reads PPS edges from a local SOCK_SEQPACKET socket. PpsSource says what it promises.
class SocketPps : public PacketSource {
 public:
  explicit SocketPps(std::string path) : path_(std::move(path)) {}
  ~SocketPps() override { close(); }
  SocketPps(const SocketPps&) = delete;
  SocketPps& operator=(const SocketPps&) = delete;

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override;

 private:
  const std::string path_;
  int fd_ = -1;
};

}  // namespace hueline::drivers
