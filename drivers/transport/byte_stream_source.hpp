#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "core/packet.hpp"

namespace hueline::drivers {

/// The common base of TcpSource and SerialSource: reads a file descriptor that delivers bytes without message
/// boundaries. After each open it sends the device a text (the dialogue), for devices that send nothing until they are
/// asked. One packet holds the bytes of one read; the decoder finds where a message ends.
/// Thread safety: none; one thread calls all functions.
class ByteStreamSource : public PacketSource {
 public:
  struct Config {
    std::string dialogue;                           ///< text that is sent unchanged after each open; may be empty
    std::size_t chunk_bytes = 16384;                ///< largest number of bytes in one packet, 64 to 1048576
    std::chrono::milliseconds write_timeout{2000};  ///< longest time that sending the dialogue may take
    /// Returns an empty text if all values are allowed, else a sentence that names the wrong one.
    std::string validate() const;
  };

  ~ByteStreamSource() override;
  ByteStreamSource(const ByteStreamSource&) = delete;
  ByteStreamSource& operator=(const ByteStreamSource&) = delete;

  /// Connects and sends the dialogue. Errors: Unavailable, Invalid, Io.
  Status open() final;
  /// Returns the bytes of one read. `received` is the host time at which the computer saw that bytes had come: for TCP
  /// and serial ports the kernel does not stamp single bytes.
  Result<Packet> next(std::stop_token stop) final;
  void close() final;

 protected:
  explicit ByteStreamSource(Config config) : config_(std::move(config)) {}
  /// Returns a connected, non-blocking file descriptor, which the caller owns.
  virtual Result<int> connect() = 0;
  /// Returns the name of the connection for messages, such as "tcp 192.168.1.10:3001".
  virtual std::string name() const = 0;

 private:
  Status send_dialogue();

  Config config_;
  int fd_ = -1;
  std::string chunk_;  // kept between calls so that its memory is reused
};

}  // namespace hueline::drivers
