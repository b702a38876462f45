#include "console/server/foxglove_client.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "core/json_text.hpp"

namespace hueline::console {
namespace {

using nlohmann::ordered_json;

constexpr std::uint32_t kConsoleChannel = 1, kIdsOfAFeed = 1000;
constexpr std::size_t kMostControl = 3000;  // more waits for a client that takes nothing
constexpr std::size_t kMostSubscriptions = 1000;

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xff));
}

std::string data_message(std::uint32_t subscription, std::int64_t unix_ns, std::string_view bytes) {
  std::string out;
  out.reserve(13 + bytes.size());
  out.push_back(1);
  put(out, subscription, 4);
  put(out, static_cast<std::uint64_t>(unix_ns), 8);
  return out.append(bytes);
}

}  // namespace

FoxgloveClient::FoxgloveClient(boost::asio::io_context& io, const DriveControl& drive, Wire& wire)
    : io_(io), drive_(drive), wire_(&wire) {}

std::uint32_t FoxgloveClient::id_of(std::uint32_t feed_channel) const {
  return generation_ * kIdsOfAFeed + 2 + feed_channel;
}

void FoxgloveClient::begin() {
  send(json_text({{"op", "serverInfo"},
                  {"name", "hueline"},
                  {"capabilities", ordered_json::array()},
                  {"supportedEncodings", ordered_json::array()},
                  {"metadata", ordered_json::object()}}));
  channels_.insert(kConsoleChannel);
  send(json_text({{"op", "advertise"},
                  {"channels",
                   {{{"id", kConsoleChannel},
                     {"topic", "/hueline/console"},
                     {"encoding", "json"},
                     {"schemaName", "hueline.Console"},
                     {"schema", R"({"type":"object"})"},
                     {"schemaEncoding", "jsonschema"}}}}}));
  tell_state();
}

void FoxgloveClient::send(const std::string& json) {
  if (control_.size() >= kMostControl) {
    if (wire_ != nullptr) wire_->close("the client takes nothing");
    return;
  }
  control_.push_back(json);
  pump();
}

void FoxgloveClient::warn(const std::string& id, const std::string& text_of_it) {
  send(json_text({{"op", "status"}, {"level", 1}, {"message", text_of_it}, {"id", id}}));
}

void FoxgloveClient::take(const std::string& message) {
  const auto shallow = [](int depth, auto, auto&) { return depth < 5; };
  const ordered_json json = ordered_json::parse(message, shallow, false);
  const std::string op = json.is_object() ? json.value("op", ordered_json()).dump() : "";
  const auto is_id = [](const ordered_json& value) {
    return value.is_number_unsigned() && value.get<std::uint64_t>() <= 0xffffffff;
  };
  if (op == "\"subscribe\"" && json.contains("subscriptions") && json["subscriptions"].is_array()) {
    for (const auto& one : json["subscriptions"]) {
      if (!one.is_object() || !one.contains("id") || !one.contains("channelId") || !is_id(one["id"]) ||
          !is_id(one["channelId"]) || subscriptions_.size() >= kMostSubscriptions)
        return warn("subscribe", "a subscription needs id and channelId; at most 1000 are kept");
      const auto channel = one["channelId"].get<std::uint32_t>();
      if (!channels_.contains(channel)) {
        warn("subscribe", fmt::format("there is no channel {}", channel));
        continue;
      }
      subscriptions_[one["id"].get<std::uint32_t>()] = channel;
      // One that subscribes again and again, and reads nothing, gets it later.
      if (channel == kConsoleChannel && data_.size() < kMostSubscriptions)
        data_.push_back(state_message(one["id"].get<std::uint32_t>()));
    }
    subscribe_at_feed();
    return pump();
  }
  if (op == "\"unsubscribe\"" && json.contains("subscriptionIds") && json["subscriptionIds"].is_array()) {
    for (const auto& id : json["subscriptionIds"])
      if (is_id(id)) subscriptions_.erase(id.get<std::uint32_t>());
    return subscribe_at_feed();
  }
  warn("op", "this server takes the operations subscribe and unsubscribe only");
}

/// Asks the feed for what the client wants of it.
void FoxgloveClient::subscribe_at_feed() {
  if (!feed_) return;
  std::set<std::uint32_t> wanted;
  for (const auto& [id, channel] : subscriptions_)
    if (channel >= id_of(0)) wanted.insert(channel - id_of(0));
  feed_->send(feed::Kind::Subscribe, ordered_json{{"channels", wanted}}.dump());
}

std::string FoxgloveClient::state_message(std::uint32_t subscription) const {
  auto json = drive_.state_json();
  json["feed"] = feed_ ? "connected" : "none";
  const auto now =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch());
  return data_message(subscription, now.count(), json_text(json));
}

void FoxgloveClient::tell_state() {
  if (wire_ == nullptr) return;
  if (!feed_ && !drive_.feed().empty()) {
    if (auto link = FeedLink::connect(io_, drive_.feed()); link.ok()) {
      feed_ = *link;
      ++generation_;
      read_feed();
    }
  }
  if (data_.size() < 10)
    for (const auto& [id, channel] : subscriptions_)
      if (channel == kConsoleChannel) data_.push_back(state_message(id));
  pump();
}

void FoxgloveClient::read_feed() {
  if (!feed_ || reads_ || !data_.empty()) return;
  reads_ = true;
  feed_->read(
      [self = shared_from_this()](const feed::FrameReader::Frame& frame) {
        self->reads_ = false;
        self->take_frame(frame);
        self->pump();
      },
      [self = shared_from_this()] {
        self->reads_ = false;
        self->lose_feed();
      });
}

void FoxgloveClient::lose_feed() {
  feed_.reset();
  auto ids = ordered_json::array();
  for (const std::uint32_t id : channels_)
    if (id != kConsoleChannel) ids.push_back(id);
  channels_ = {kConsoleChannel};
  std::erase_if(subscriptions_, [](const auto& one) { return one.second != kConsoleChannel; });
  if (wire_ == nullptr) return;
  if (!ids.empty()) send(json_text({{"op", "unadvertise"}, {"channelIds", ids}}));
  tell_state();
}

void FoxgloveClient::take_frame(const feed::FrameReader::Frame& frame) {
  if (wire_ == nullptr) return;
  if (frame.kind == feed::Kind::Message) {
    const auto message = feed::read_message(frame.content);
    if (!message) return;
    for (const auto& [id, channel] : subscriptions_)
      if (channel == id_of(message->channel)) data_.push_back(data_message(id, message->unix_ns, message->bytes));
    return;
  }
  const ordered_json json = ordered_json::parse(frame.content, nullptr, false);
  if (!json.is_object()) return;
  if (frame.kind == feed::Kind::Channel) {
    const auto id = json.value("id", std::uint32_t{0});
    if (id >= kIdsOfAFeed - 2) return;
    channels_.insert(id_of(id));
    send(json_text({{"op", "advertise"},
                    {"channels",
                     {{{"id", id_of(id)},
                       {"topic", json.value("topic", "")},
                       {"encoding", json.value("encoding", "")},
                       {"schemaName", json.value("schema_name", "")},
                       {"schema", json.value("schema", "")},
                       {"schemaEncoding", json.value("schema_encoding", "")}}}}}));
  } else if (frame.kind == feed::Kind::Lost) {
    warn("lost",
         fmt::format("{} messages left out so far: this connection is slow", json.value("messages", std::uint64_t{0})));
  }
}

void FoxgloveClient::written() {
  writes_ = false;
  pump();
}

void FoxgloveClient::pump() {
  if (wire_ == nullptr || writes_) return;
  auto& queue = control_.empty() ? data_ : control_;
  if (queue.empty()) return read_feed();
  std::string message = std::move(queue.front());
  queue.pop_front();
  writes_ = true;
  const bool is_text = &queue == &control_;
  wire_->write(std::move(message), is_text);
}

void FoxgloveClient::end() {
  wire_ = nullptr;
  if (feed_) feed_->close();
  feed_.reset();
}

}  // namespace hueline::console
