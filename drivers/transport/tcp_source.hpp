#pragma once

#include "core/keys.hpp"
#include "drivers/transport/byte_stream_source.hpp"

namespace hueline::drivers {

/// TCP client. Keep-alive finds a peer that vanished without a word within about `peer_timeout`.
class TcpSource final : public ByteStreamSource {
 public:
  struct Config {
    std::string host;  ///< address; a name is looked up with the system's resolver, which may block
    int port = 0;      ///< 1 .. 65535
    std::chrono::milliseconds connect_timeout{2000};
    std::chrono::seconds peer_timeout{10};  ///< unanswered keep-alives for so long: Disconnected
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
