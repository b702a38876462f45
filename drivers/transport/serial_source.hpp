#pragma once

#include <string>

#include "core/keys.hpp"
#include "drivers/transport/byte_stream_source.hpp"

namespace hueline::drivers {

/// Reads a serial port: raw bytes, 8N1, no flow control. If a USB adapter is unplugged, next() returns Disconnected;
/// open() works again when the adapter is back. Give the port's name in /dev/serial/by-id/, which does not change when
/// the adapter is plugged in again.
class SerialSource final : public ByteStreamSource {
 public:
  struct Config {
    std::string device = "/dev/ttyUSB0";
    int baud = 115200;  ///< bits per second; any number that the hardware can make, including 460800 and 921600
    ByteStreamSource::Config stream;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit SerialSource(Config config);

 private:
  Result<int> connect() override;
  std::string name() const override;

  Config config_;
};

}  // namespace hueline::drivers
