#include "drivers/transport/tcp_source.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/transport/socket_option.hpp"

namespace hueline::drivers {
namespace {

/// Connects within `timeout_ms`. Returns 0, or the errno of what failed.
int connect_within(int fd, const addrinfo& address, int timeout_ms) {
  if (::connect(fd, address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  pollfd ready{fd, POLLOUT, 0};
  const int count = ::poll(&ready, 1, timeout_ms);
  if (count < 0) return errno;
  if (count == 0) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof(error);
  if (::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) < 0) return errno;
  return error;
}

/// Returns whether a text can be the address of a computer, IPv4 or IPv6, or its name in DNS (RFC 1123, section 2.1),
/// with the underscores that local networks have. What ends in a number is no name: it is a mistyped address.
bool is_host(const std::string& text) {
  in6_addr address{};  // has room for an IPv4 address, too
  if (::inet_pton(AF_INET, text.c_str(), &address) == 1) return true;
  if (::inet_pton(AF_INET6, text.substr(0, text.find('%')).c_str(), &address) == 1) return true;  // %: its interface
  constexpr std::size_t kLongestName = 253, kLongestLabel = 63;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_in_name = [&](char c) {
    return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
  };
  std::string_view rest(text), label;
  if (rest.ends_with('.')) rest.remove_suffix(1);
  if (rest.size() > kLongestName) return false;
  for (bool is_last = false; !is_last;) {
    const std::size_t dot = rest.find('.');
    is_last = dot == std::string_view::npos;
    label = rest.substr(0, dot);
    if (label.empty() || label.size() > kLongestLabel || label.starts_with('-') || label.ends_with('-')) return false;
    if (!std::ranges::all_of(label, is_in_name)) return false;
    if (!is_last) rest.remove_prefix(dot + 1);
  }
  return !std::ranges::all_of(label, is_digit);
}
constexpr TextForm kHost{"an IPv4 or IPv6 address, or the name of a computer", is_host};

}  // namespace

void TcpSource::Config::visit(Keys& keys) {
  keys.text(required("host", "", "The device's address or name."), host, kHost);
  keys.whole(required("port", "", "The device's TCP port."), port, {1, 65535});
}

KeyError TcpSource::Config::validate() const {
  if (KeyError wrong = check_keys(*this); !wrong.empty()) return wrong;
  if (host.empty()) return not_allowed("host", "empty", kHost.allowed);
  if (connect_timeout.count() < 10 || connect_timeout.count() > 60000)
    return not_allowed("connect_timeout", std::to_string(connect_timeout.count()), "10 to 60000 ms");
  if (peer_timeout.count() < 3 || peer_timeout.count() > 3600)
    return not_allowed("peer_timeout", std::to_string(peer_timeout.count()), "3 to 3600 s");
  return {"", stream.validate()};
}

TcpSource::TcpSource(Config config) : ByteStreamSource(config.stream), config_(std::move(config)) {}

std::string TcpSource::name() const { return fmt::format("tcp {}:{}", config_.host, config_.port); }

Result<int> TcpSource::connect() {
  if (const std::string wrong = config_.validate(); !wrong.empty()) return Error{ErrorCode::Invalid, wrong};
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* list = nullptr;
  if (const int error = ::getaddrinfo(config_.host.c_str(), std::to_string(config_.port).c_str(), &hints, &list);
      error != 0)
    return Error{ErrorCode::Unavailable, fmt::format("{}: {}", name(), ::gai_strerror(error))};
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(list, &::freeaddrinfo);

  int error = EADDRNOTAVAIL;
  for (const addrinfo* address = list; address; address = address->ai_next) {
    const int fd = ::socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) {
      error = errno;
      continue;
    }
    error = connect_within(fd, *address, static_cast<int>(config_.connect_timeout.count()));
    if (error == 0) {
      const int seconds = static_cast<int>(config_.peer_timeout.count());
      // Errors are ignored: without these options the connection works as well, only less precisely.
      (void)set_socket_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
      (void)set_socket_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
      (void)set_socket_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, std::max(1, seconds / 3));
      (void)set_socket_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, std::max(1, seconds / 3));
      (void)set_socket_option(fd, IPPROTO_TCP, TCP_KEEPCNT, 2);
      return fd;
    }
    ::close(fd);
  }
  return Error{ErrorCode::Unavailable, fmt::format("{}: {}", name(), std::strerror(error))};
}

}  // namespace hueline::drivers
