#pragma once

#include <chrono>
#include <string>

#include "core/packet.hpp"

namespace hueline::drivers {

/// What TCP and serial have in common: a file descriptor that gives bytes without boundaries, and a device that may
/// want to be spoken to first. Each packet is what one read brought, stamped on arrival; where a message ends is the
/// decoder's affair. Thread-bound.
class ByteStreamSource : public PacketSource {
 public:
  struct Config {
    std::string dialogue;                           ///< sent after each open, as it is; may be empty
    std::size_t chunk_bytes = 16384;                ///< most that one packet holds
    std::chrono::milliseconds write_timeout{2000};  ///< for the dialogue
    std::string validate() const;
  };

  ~ByteStreamSource() override;
  ByteStreamSource(const ByteStreamSource&) = delete;
  ByteStreamSource& operator=(const ByteStreamSource&) = delete;

  /// Connects and sends the dialogue. Unavailable, Invalid, Io.
  Status open() final;
  /// Stamped with host time when the computer saw that bytes had come (TCP and serial have no kernel stamp of each
  /// byte).
  Result<Packet> next(std::stop_token stop) final;
  void close() final;

 protected:
  explicit ByteStreamSource(Config config) : config_(std::move(config)) {}
  /// A connected, non-blocking descriptor.
  virtual Result<int> connect() = 0;
  /// For messages to people: "tcp 192.168.1.10:3001".
  virtual std::string name() const = 0;

 private:
  Status send_dialogue();

  Config config_;
  int fd_ = -1;
  std::string chunk_;  // reused
};

}  // namespace hueline::drivers
