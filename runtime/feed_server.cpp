#include "runtime/feed_server.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base64.hpp"
#include "core/json_text.hpp"

namespace hueline::runtime {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostControl = 256;  // frames that are no messages; a listener with more does not read at all

}  // namespace

FeedServer::FeedServer(std::filesystem::path path, FileDescriptor socket, std::string hello, OnCommand on_command,
                       OnSubscribe on_subscribe)
    : path_(std::move(path)),
      socket_(std::move(socket)),
      hello_(std::move(hello)),
      on_command_(std::move(on_command)),
      on_subscribe_(std::move(on_subscribe)) {}

FeedServer::~FeedServer() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

Result<std::unique_ptr<FeedServer>> FeedServer::create(const std::filesystem::path& path, std::string hello,
                                                       OnCommand on_command, OnSubscribe on_subscribe) {
  auto socket = listen_locally(path);
  if (!socket.ok()) return socket.error();
  return std::unique_ptr<FeedServer>(
      new FeedServer(path, std::move(*socket), std::move(hello), std::move(on_command), std::move(on_subscribe)));
}

std::string FeedServer::describe(std::size_t channel) const {
  const Channel& one = channels_[channel];
  return feed::frame(feed::Kind::Channel,
                     json_text({{"id", channel},
                                {"topic", one.topic},
                                {"encoding", one.encoding},
                                {"schema_name", one.schema_name},
                                {"schema_encoding", one.schema_encoding},
                                {"schema", one.schema_encoding == "protobuf" ? base64(one.schema) : one.schema}}));
}

std::size_t FeedServer::add(Channel channel) {
  channels_.push_back(std::move(channel));
  for (auto& listener : listeners_) listener->control.push_back(describe(channels_.size() - 1));
  return channels_.size() - 1;
}

bool FeedServer::is_wanted(std::size_t channel) const {
  return std::ranges::any_of(listeners_, [&](const auto& one) { return one->channels.contains(channel); });
}

void FeedServer::publish(std::size_t channel, std::int64_t unix_ns, std::string_view bytes) {
  if (!channels_[channel].is_kept && !is_wanted(channel)) return;
  auto frame =
      std::make_shared<const std::string>(feed::message_frame(static_cast<std::uint32_t>(channel), unix_ns, bytes));
  if (channels_[channel].is_kept) kept_[channel] = frame;
  for (auto& listener : listeners_)
    if (listener->channels.contains(channel)) queue(*listener, channel, frame);
}

void FeedServer::queue(Listener& listener, std::size_t channel, std::shared_ptr<const std::string> frame) {
  auto& waiting = listener.waiting[channel];
  waiting.push_back(std::move(frame));
  for (; waiting.size() > channels_[channel].depth; waiting.pop_front()) ++listener.lost, ++lost_;
}

void FeedServer::wait(int milliseconds) {
  std::vector<pollfd> polled{{socket_.get(), POLLIN, 0}};
  for (auto& listener : listeners_) {
    write(*listener);
    polled.push_back({listener->socket.get(), static_cast<short>(listener->now ? POLLIN | POLLOUT : POLLIN), 0});
  }
  if (::poll(polled.data(), polled.size(), milliseconds) > 0) {
    for (std::size_t i = 0; i < listeners_.size(); ++i) {
      const short events = polled[i + 1].revents;
      if (events & (POLLIN | POLLHUP | POLLERR)) read(*listeners_[i]);
      if (events & POLLOUT) write(*listeners_[i]);
    }
    if (polled[0].revents & POLLIN) accept_all();
  }
  std::erase_if(listeners_, [](const auto& one) { return one->is_over; });
}

void FeedServer::accept_all() {
  for (;;) {
    FileDescriptor socket(::accept4(socket_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket.is_open()) return;
    if (listeners_.size() >= kMostListeners) continue;  // closed at once
    auto listener = std::make_unique<Listener>();
    listener->socket = std::move(socket);
    listener->control.push_back(feed::frame(feed::Kind::Hello, hello_));
    for (std::size_t i = 0; i < channels_.size(); ++i) listener->control.push_back(describe(i));
    listeners_.push_back(std::move(listener));
  }
}

void FeedServer::read(Listener& listener) {
  std::array<char, 4096> bytes;
  for (int i = 0; i < 8; ++i) {  // nobody keeps the others waiting
    const ssize_t got = ::recv(listener.socket.get(), bytes.data(), bytes.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) break;
    if (got <= 0) {
      listener.is_over = true;
      return;
    }
    listener.reader.add({bytes.data(), static_cast<std::size_t>(got)});
    for (;;) {
      auto frame = listener.reader.next();
      if (!frame.ok()) {
        listener.is_over = true;
        return;
      }
      if (!*frame) break;
      take(listener, **frame);
      if (listener.is_over) return;
    }
  }
}

/// Takes a frame of a listener. A listener that breaks the protocol is disconnected.
void FeedServer::take(Listener& listener, const feed::FrameReader::Frame& frame) {
  // The depth of the JSON is limited by the callback: commands are flat.
  const auto shallow = [](int depth, auto, auto&) { return depth < 4; };
  const ordered_json json = ordered_json::parse(frame.content, shallow, false);
  const auto is_id = [](const ordered_json& value) { return value.is_number_unsigned(); };
  if (frame.kind == feed::Kind::Subscribe && json.is_object() && json.contains("channels") &&
      json["channels"].is_array()) {
    std::set<std::size_t> channels;
    for (const auto& id : json["channels"])
      if (is_id(id) && id.get<std::size_t>() < channels_.size()) channels.insert(id.get<std::size_t>());
    return subscribe(listener, channels);
  }
  if (frame.kind == feed::Kind::Command && json.is_object() && json.contains("id") && is_id(json["id"]) &&
      json.contains("command") && json["command"].is_string() && listener.control.size() < kMostControl) {
    const std::string note =
        json.contains("note") && json["note"].is_string() ? json["note"].get<std::string>() : std::string();
    const Status done = on_command_(json["command"].get<std::string>(), note);
    listener.control.push_back(feed::frame(
        feed::Kind::Answer, json_text({{"id", json["id"]}, {"error", done.ok() ? "" : done.error().message}})));
    return;
  }
  listener.is_over = true;
}

void FeedServer::subscribe(Listener& listener, const std::set<std::size_t>& channels) {
  const auto before = std::exchange(listener.channels, channels);
  std::erase_if(listener.waiting, [&](const auto& one) { return !channels.contains(one.first); });
  for (const std::size_t channel : channels) {
    if (before.contains(channel)) continue;
    if (const auto kept = kept_.find(channel); kept != kept_.end()) queue(listener, channel, kept->second);
    for (std::string& frame : on_subscribe_(channel))
      queue(listener, channel, std::make_shared<const std::string>(std::move(frame)));
  }
}

/// Chooses the next frame to write: first what is no message, then the channels in turn.
bool FeedServer::take_next(Listener& listener) {
  if (listener.control.empty() && listener.lost > listener.told_lost) {
    listener.told_lost = listener.lost;
    listener.control.push_back(feed::frame(feed::Kind::Lost, json_text({{"messages", listener.lost}})));
  }
  if (!listener.control.empty()) {
    listener.now = std::make_shared<const std::string>(std::move(listener.control.front()));
    listener.control.pop_front();
    return true;
  }
  auto turn = listener.waiting.lower_bound(listener.next);
  for (std::size_t i = 0; i <= listener.waiting.size(); ++i) {
    if (turn == listener.waiting.end()) turn = listener.waiting.begin();
    if (turn == listener.waiting.end()) return false;
    if (!turn->second.empty()) {
      listener.now = std::move(turn->second.front());
      turn->second.pop_front();
      listener.next = turn->first + 1;
      return true;
    }
    ++turn;
  }
  return false;
}

void FeedServer::write(Listener& listener) {
  constexpr std::size_t kMostAtOnce = std::size_t{1} << 20;  // then it is the others' turn
  for (std::size_t sum = 0; sum < kMostAtOnce && !listener.is_over;) {
    if (!listener.now && !take_next(listener)) return;
    const std::string& frame = *listener.now;
    const ssize_t sent = ::send(listener.socket.get(), frame.data() + listener.written, frame.size() - listener.written,
                                MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0) {
      listener.is_over = errno != EAGAIN && errno != EINTR && errno != ENOBUFS;
      return;
    }
    sum += static_cast<std::size_t>(sent);
    listener.written += static_cast<std::size_t>(sent);
    if (listener.written < frame.size()) continue;
    listener.now.reset();
    listener.written = 0;
  }
}

}  // namespace hueline::runtime
