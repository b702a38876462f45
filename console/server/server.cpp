#include "console/server/server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <cctype>
#include <map>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "console/server/foxglove_client.hpp"

namespace hueline::console {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using TlsStream = asio::ssl::stream<beast::tcp_stream>;

/// What all connections share.
struct Server::Shared {
  asio::io_context& io;
  Api& api;
  DriveControl& drive;
  Config config;
  std::size_t connections = 0;
  struct Opened {
    Wire* wire;
    Request by;
  };
  std::map<FoxgloveClient*, Opened> clients;  // with the requests that have opened their WebSockets
};

namespace {

constexpr std::size_t kMostHeader = 16'384, kMostBody = 65'536, kMostMessage = 65'536;
/// The system's buffer for a connection: what is in it cannot be left out any more, so it is small.
constexpr int kSendBuffer = 262'144;

/// Counts a connection while it lives.
struct Counted {
  explicit Counted(Server::Shared& all) : shared(all) { ++shared.connections; }
  ~Counted() { --shared.connections; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  Server::Shared& shared;
};

/// A WebSocket.
template <class Stream>
class Socket : public Wire, public std::enable_shared_from_this<Socket<Stream>> {
 public:
  Socket(Stream stream, std::shared_ptr<Counted> counted)
      : stream_(std::move(stream)), counted_(std::move(counted)), shared_(counted_->shared) {}

  void run(const http::request<http::string_body>& request, const Request& opened, const std::string& protocol) {
    stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    stream_.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& response) {
      response.set(http::field::sec_websocket_protocol, protocol);
      response.set(http::field::server, "hueline");
    }));
    stream_.read_message_max(kMostMessage);
    stream_.auto_fragment(false);
    stream_.async_accept(request, [self = this->shared_from_this(), opened](error_code failed) {
      if (failed) return;
      self->client_ = std::make_shared<FoxgloveClient>(self->shared_.io, self->shared_.drive, *self);
      self->shared_.clients.emplace(self->client_.get(), Server::Shared::Opened{self.get(), opened});
      self->client_->begin();
      self->read();
    });
  }

  void write(std::string message, bool is_text) override {
    message_ = std::move(message);
    stream_.text(is_text);
    stream_.async_write(asio::buffer(message_), [self = this->shared_from_this()](error_code failed, std::size_t) {
      if (failed) return self->end();
      if (self->client_) self->client_->written();
    });
  }

  void close(const std::string&) override {
    asio::post(stream_.get_executor(), [self = this->shared_from_this()] {
      self->end();
      beast::get_lowest_layer(self->stream_).close();
    });
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = this->shared_from_this()](error_code failed, std::size_t) {
      if (failed || !self->client_) return self->end();
      const bool is_text = self->stream_.got_text();
      const std::string text = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      if (is_text) self->client_->take(text);
      self->read();
    });
  }

  void end() {
    if (!client_) return;
    shared_.clients.erase(client_.get());
    client_->end();
    client_.reset();
    beast::get_lowest_layer(stream_).close();
  }

  websocket::stream<Stream> stream_;
  std::shared_ptr<Counted> counted_;
  Server::Shared& shared_;
  beast::flat_buffer buffer_{kMostMessage};
  std::string message_;
  std::shared_ptr<FoxgloveClient> client_;
};

/// A connection that sends HTTP requests, one after the other.
template <class Stream>
class Connection : public std::enable_shared_from_this<Connection<Stream>> {
 public:
  template <class... Arguments>
  Connection(Server::Shared& shared, std::string address, Arguments&&... arguments)
      : stream_(std::forward<Arguments>(arguments)...),
        counted_(std::make_shared<Counted>(shared)),
        shared_(shared),
        address_(std::move(address)) {}

  void run() {
    beast::get_lowest_layer(stream_).expires_after(shared_.config.request_time);
    if constexpr (kIsSecure) {
      stream_.async_handshake(asio::ssl::stream_base::server, [self = this->shared_from_this()](error_code failed) {
        if (!failed) self->read(self->shared_.config.request_time);
      });
    } else {
      read(shared_.config.request_time);
    }
  }

 private:
  static constexpr bool kIsSecure = std::is_same_v<Stream, TlsStream>;

  /// Waits at most `time` for the first byte; from then on a request has its own time.
  void read(std::chrono::seconds time) {
    beast::get_lowest_layer(stream_).expires_after(time);
    parser_.emplace();
    parser_->header_limit(kMostHeader);
    parser_->body_limit(kMostBody);
    if (buffer_.size() > 0) return read_request();
    stream_.async_read_some(buffer_.prepare(4096),
                            [self = this->shared_from_this()](error_code failed, std::size_t got) {
                              if (failed) return;
                              self->buffer_.commit(got);
                              self->read_request();
                            });
  }

  void read_request() {
    beast::get_lowest_layer(stream_).expires_after(shared_.config.request_time);
    http::async_read(stream_, buffer_, *parser_, [self = this->shared_from_this()](error_code failed, std::size_t) {
      if (failed == http::error::end_of_stream) return self->shut();
      if (failed == http::error::header_limit) return self->answer(refuse(431, "the header is too large"), true);
      if (failed == http::error::body_limit) return self->answer(refuse(413, "the body is too large"), true);
      if (failed && failed.category() == boost::beast::http::make_error_code(http::error::bad_method).category())
        return self->answer(refuse(400, "this is no HTTP request"), true);
      if (failed) return;
      self->take();
    });
  }

  void take() {
    const auto& message = parser_->get();
    Request request;
    request.method = std::string(message.method_string());
    const std::string target(message.target());
    const std::size_t mark = target.find('?');
    request.path = target.substr(0, mark);
    if (mark != std::string::npos) request.query = target.substr(mark + 1);
    for (const auto& field : message) {
      std::string name(field.name_string());
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      request.headers[name] = std::string(field.value());
    }
    request.body = message.body();
    request.address = address_;
    request.is_secure = kIsSecure;
    const bool ends = !message.keep_alive();
    if (websocket::is_upgrade(message)) return upgrade(request);
    beast::get_lowest_layer(stream_).expires_never();
    shared_.api.answer(request,
                       [self = this->shared_from_this(), ends](const Answer& answer) { self->answer(answer, ends); });
  }

  void upgrade(const Request& request) {
    if (request.path != "/" && request.path != "/ws") return answer(refuse(404, "the WebSocket is at /ws"), true);
    Answer refusal;
    if (!shared_.api.client_of_socket(request, refusal)) return answer(refusal, true);
    if (shared_.clients.size() >= shared_.config.most_sockets)
      return answer(refuse(503, "too many clients look at this drive: close one"), true);
    // The first of the client's protocols that is known.
    std::string chosen;
    const auto offered = request.headers.find("sec-websocket-protocol");
    const std::string protocols = offered == request.headers.end() ? "" : offered->second;
    for (const auto& one : http::token_list(protocols))
      for (const char* known : FoxgloveClient::kProtocols)
        if (chosen.empty() && one == known) chosen = known;
    if (chosen.empty())
      return answer(refuse(400, "offer the subprotocol foxglove.websocket.v1 or foxglove.sdk.v1"), true);
    beast::get_lowest_layer(stream_).expires_never();
    std::make_shared<Socket<Stream>>(std::move(stream_), std::move(counted_))->run(parser_->release(), request, chosen);
  }

  void answer(const Answer& from, bool ends) {
    auto response = std::make_shared<http::response<http::string_body>>();
    response->version(11);
    response->result(from.status);
    response->set(http::field::server, "hueline");
    response->set(http::field::content_type, from.type);
    response->set("X-Content-Type-Options", "nosniff");
    response->set("Referrer-Policy", "no-referrer");
    response->set(http::field::x_frame_options, "SAMEORIGIN");
    response->set("Cross-Origin-Opener-Policy", "same-origin");
    response->set("Cross-Origin-Resource-Policy", "same-origin");
    response->set("Permissions-Policy", "camera=(), microphone=(), geolocation=()");
    response->set(
        "Content-Security-Policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; font-src 'self'; "
        "connect-src 'self' ws: wss:; worker-src 'self' blob:; media-src 'self' blob:; manifest-src 'self'; "
        "frame-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'");
    response->set(http::field::cache_control, "no-store");
    for (const auto& [name, value] : from.headers) response->set(name, value);
    if (kIsSecure) response->set(http::field::strict_transport_security, "max-age=31536000");
    response->keep_alive(!ends);
    if (parser_ && parser_->get().method() == http::verb::head) {
      response->content_length(from.body.size());
    } else {
      response->body() = from.body;
      response->prepare_payload();
    }
    beast::get_lowest_layer(stream_).expires_after(shared_.config.idle_time);
    http::async_write(stream_, *response,
                      [self = this->shared_from_this(), response, ends](error_code failed, std::size_t) {
                        if (failed) return;
                        if (ends) return self->shut();
                        self->read(self->shared_.config.idle_time);
                      });
  }

  void shut() {
    if constexpr (kIsSecure) {
      beast::get_lowest_layer(stream_).expires_after(std::chrono::seconds(2));
      stream_.async_shutdown([self = this->shared_from_this()](error_code) {});
    } else {
      error_code ignored;
      stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    }
  }

  Stream stream_;
  std::shared_ptr<Counted> counted_;
  Server::Shared& shared_;
  const std::string address_;
  beast::flat_buffer buffer_{kMostHeader + kMostBody};
  std::optional<http::request_parser<http::string_body>> parser_;
};

}  // namespace

Server::Server(asio::io_context& io, Api& api, DriveControl& drive, Config config)
    : shared_(new Shared{io, api, drive, std::move(config), 0, {}}), acceptor_(io), timer_(io), retry_(io) {}

Server::~Server() = default;

Status Server::start() {
  const auto wrong = [&](const std::string& what) {
    return Error{ErrorCode::Io, fmt::format("{} port {}: {}", shared_->config.address, shared_->config.port, what)};
  };
  error_code failed;
  const auto address = asio::ip::make_address(shared_->config.address, failed);
  if (failed) return wrong("this is no address of this computer: give one such as 127.0.0.1, 0.0.0.0 or ::");
  const asio::ip::tcp::endpoint at(address, shared_->config.port);
  acceptor_.open(at.protocol(), failed);
  if (!failed) acceptor_.set_option(asio::socket_base::reuse_address(true), failed);
  if (!failed) acceptor_.bind(at, failed);
  if (!failed) acceptor_.listen(128, failed);
  if (failed == asio::error::address_in_use) return wrong(failed.message() + ": does a console run already?");
  if (failed == boost::system::errc::address_not_available)
    return wrong("this computer has no such address: `ip address` lists those it has; 0.0.0.0 is all of them");
  if (failed == asio::error::access_denied) return wrong(failed.message() + ": choose a port from 1024 on");
  if (failed) return wrong(failed.message());
  shared_->drive.on_change = [this] { tell_state(); };
  accept();
  tell_state();
  return {};
}

std::uint16_t Server::port() const { return acceptor_.local_endpoint().port(); }

/// Tells all clients the state, at once and then every two seconds, and closes the WebSockets of those who may not look
/// any more.
void Server::tell_state() {
  std::vector<FoxgloveClient*> clients;
  for (const auto& [client, opened] : shared_->clients) clients.push_back(client);
  for (FoxgloveClient* client : clients) {
    const auto known = shared_->clients.find(client);
    if (known == shared_->clients.end()) continue;
    if (shared_->api.may_keep_socket(known->second.by))
      client->tell_state();
    else
      known->second.wire->close("the session has ended");
  }
  timer_.expires_after(std::chrono::seconds(2));
  timer_.async_wait([this](error_code failed) {
    if (!failed) tell_state();
  });
}

void Server::accept() {
  acceptor_.async_accept([this](error_code failed, asio::ip::tcp::socket socket) {
    if (failed == asio::error::operation_aborted) return;
    if (failed) {
      // Out of descriptors: waiting is better than asking again at once.
      retry_.expires_after(std::chrono::milliseconds(100));
      retry_.async_wait([this](error_code stopped) {
        if (!stopped) accept();
      });
      return;
    }
    error_code ignored;
    const auto peer = socket.remote_endpoint(ignored);
    if (!ignored && shared_->connections < shared_->config.most_connections) {
      const std::string address = peer.address().to_string();
      socket.set_option(asio::ip::tcp::no_delay(true), ignored);
      socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
      if (shared_->config.tls != nullptr)
        std::make_shared<Connection<TlsStream>>(*shared_, address, std::move(socket), *shared_->config.tls)->run();
      else
        std::make_shared<Connection<beast::tcp_stream>>(*shared_, address, std::move(socket))->run();
    }
    accept();
  });
}

}  // namespace hueline::console
