#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <string>

#include "console/server/api.hpp"
#include "console/server/drive_control.hpp"
#include "core/result.hpp"

namespace boost::asio::ssl {
class context;
}

namespace hueline::console {

class FoxgloveClient;

/// The console's server: HTTP and WebSocket on one port, with or without TLS, on one thread. What a client can cost is
/// limited: connections, the size of headers, bodies and messages, and the time that a request may take.
class Server {
 public:
  struct Config {
    std::string address = "127.0.0.1";
    std::uint16_t port = 8765;                 ///< 0: any free one
    boost::asio::ssl::context* tls = nullptr;  ///< null: plain HTTP. It must outlive the server.
    std::size_t most_connections = 256;
    std::size_t most_sockets = 112;         ///< WebSockets; each is a listener of the feed
    std::chrono::seconds request_time{10};  ///< for TLS, a header and a body together
    std::chrono::seconds idle_time{60};     ///< between two requests
  };
  Server(boost::asio::io_context& io, Api& api, DriveControl& drive, Config config);
  ~Server();
  /// Opens the port. Error: Io.
  Status start();
  std::uint16_t port() const;

  // For connections.
  struct Shared;

 private:
  void accept();
  void tell_state();

  std::unique_ptr<Shared> shared_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer timer_, retry_;
};

}  // namespace hueline::console
