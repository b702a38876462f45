#pragma once

#include <string>

#include "core/keys.hpp"
#include "drivers/transport/byte_stream_source.hpp"

namespace hueline::drivers {

/// Reads a TCP connection as its client. TCP keep-alive detects within about `peer_timeout` that the peer disappeared
/// without closing the connection.
class TcpSource final : public ByteStreamSource {
 public:
  struct Config {
    std::string host;  ///< address or name; the system's resolver looks a name up, and may block
    int port = 0;      ///< 1 to 65535
    std::chrono::milliseconds connect_timeout{2000};
    /// If keep-alives stay unanswered for this time, next() returns Disconnected.
    std::chrono::seconds peer_timeout{10};
    ByteStreamSource::Config stream;
    void visit(Keys& keys);
    KeyError validate() const;
  };
  explicit TcpSource(Config config);

 private:
  Result<int> connect() override;
  std::string name() const override;

  Config config_;
};

}  // namespace hueline::drivers
