#include "drivers/transport/text_exchange.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr std::size_t kMostBytes = 4'000'000;

/// Returns the text of a body that is sent in chunks, or nothing if they are broken.
std::optional<std::string> unchunked(std::string_view body) {
  std::string out;
  for (;;) {
    const auto line = body.find("\r\n");
    if (line == std::string_view::npos) return {};
    std::size_t size = 0;
    const auto [end, error] = std::from_chars(body.data(), body.data() + line, size, 16);
    if (error != std::errc() || end == body.data()) return {};
    body.remove_prefix(line + 2);
    if (size == 0) return out;
    if (body.size() < size || body.size() - size < 2) return {};
    out += body.substr(0, size);
    body.remove_prefix(size + 2);
  }
}

}  // namespace

TextExchange::TextExchange(Config config, HostTime now) : config_(std::move(config)), began_(now) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(config_.port);
  if (::inet_pton(AF_INET, config_.address.c_str(), &address.sin_addr) != 1) {
    error_ = failed(ErrorCode::Unavailable, "no IPv4 address");
    return;
  }
  socket_ = FileDescriptor(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket_) {
    error_ = failed(ErrorCode::Unavailable, std::strerror(errno));
    return;
  }
  if (::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0)
    is_connected_ = true;
  else if (errno != EINPROGRESS)
    error_ = failed(ErrorCode::Unavailable, std::strerror(errno));
}

Error TextExchange::failed(ErrorCode code, std::string_view why) const {
  return {code, fmt::format("{}:{}: {}", config_.address, config_.port, why)};
}

/// Sends the rest of the present question as far as the connection takes it.
std::optional<Error> TextExchange::send() {
  const std::string& question = config_.questions[answers_.size()];
  while (sent_ < question.size()) {
    const auto count = ::send(socket_.get(), question.data() + sent_, question.size() - sent_, MSG_NOSIGNAL);
    if (count < 0) {
      if (errno == EAGAIN || errno == EINTR) return {};
      return failed(ErrorCode::Disconnected, std::strerror(errno));
    }
    sent_ += static_cast<std::size_t>(count);
  }
  return {};
}

std::optional<Result<std::vector<std::string>>> TextExchange::step(HostTime now) {
  if (error_) return *error_;
  if (now - began_ > config_.timeout) return failed(ErrorCode::TimedOut, "no answer");
  if (!is_connected_) {
    pollfd ready{socket_.get(), POLLOUT, 0};
    if (::poll(&ready, 1, 0) <= 0) return {};
    int error = 0;
    socklen_t size = sizeof(error);
    if (::getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error, &size) < 0) error = errno;
    if (error != 0) return failed(ErrorCode::Unavailable, std::strerror(error));
    is_connected_ = true;
  }
  while (answers_.size() < config_.questions.size()) {
    if (auto error = send()) return *error;
    std::array<char, 16384> bytes;
    const auto count = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (count < 0) {
      if (errno == EAGAIN || errno == EINTR) return {};
      return failed(ErrorCode::Disconnected, std::strerror(errno));
    }
    if (count == 0) {
      if (!config_.ends_by_close) return failed(ErrorCode::Disconnected, "closed before its answer");
      answers_.push_back(std::move(received_));
      break;
    }
    received_.append(bytes.data(), static_cast<std::size_t>(count));
    if (received_.size() > kMostBytes) return failed(ErrorCode::Exhausted, "an answer without an end");
    const auto line = received_.find('\n');
    if (config_.ends_by_close || line == std::string::npos) continue;
    answers_.push_back(received_.substr(0, line));
    received_.erase(0, line + 1);
    sent_ = 0;
  }
  return std::move(answers_);
}

std::string http_question(std::string_view host, std::string_view page) {
  return fmt::format("GET {} HTTP/1.0\r\nHost: {}\r\nAccept: application/json\r\nConnection: close\r\n\r\n", page,
                     host);
}

Result<std::string> http_body(std::string_view answer) {
  const auto head_end = answer.find("\r\n\r\n");
  if (!answer.starts_with("HTTP/1.") || head_end == std::string_view::npos || answer.find(' ') > head_end)
    return Error{ErrorCode::Malformed, "the answer is not HTTP"};
  const std::string_view status = answer.substr(answer.find(' ') + 1, 3);
  if (status != "200") return Error{ErrorCode::Unavailable, fmt::format("HTTP status {}", status)};
  std::string head(answer.substr(0, head_end));
  std::ranges::transform(head, head.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string_view body = answer.substr(head_end + 4);
  if (head.find("transfer-encoding: chunked") == std::string::npos) {
    const auto at = head.find("content-length:");
    if (at == std::string::npos) return std::string(body);
    std::size_t length = 0, begin = at + 15;
    while (begin < head.size() && head[begin] == ' ') ++begin;
    std::from_chars(head.data() + begin, head.data() + head.size(), length);
    if (body.size() < length) return Error{ErrorCode::Malformed, "the answer of HTTP is cut off"};
    return std::string(body.substr(0, length));
  }
  auto whole = unchunked(body);
  if (!whole) return Error{ErrorCode::Malformed, "the answer of HTTP has broken chunks"};
  return std::move(*whole);
}

}  // namespace hueline::drivers
