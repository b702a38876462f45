#pragma once

#include "core/keys.hpp"
#include "drivers/transport/byte_stream_source.hpp"

namespace hueline::drivers {

/// Serial port, raw 8N1 without flow control. Unplugging a USB adapter gives Disconnected; opening again finds it when
/// it is back, best under a name of /dev/serial/by-id/ that does not change.
class SerialSource final : public ByteStreamSource {
 public:
  struct Config {
    std::string device = "/dev/ttyUSB0";
    int baud = 115200;  ///< any number the hardware can make, 460800 and 921600 included
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
