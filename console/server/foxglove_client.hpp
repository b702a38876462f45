#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "console/server/drive_control.hpp"
#include "console/server/feed_link.hpp"

namespace hueline::console {

/// The WebSocket of a client, as FoxgloveClient uses it.
class Wire {
 public:
  virtual ~Wire() = default;
  /// Writes one message; `written` of the client is called when it is on its way. Not to be called again before.
  virtual void write(std::string message, bool is_text) = 0;
  virtual void close(const std::string& why) = 0;
};

/// One client of the Foxglove WebSocket protocol, in its versions `foxglove.websocket.v1` and `foxglove.sdk.v1`, which
/// have the same messages (https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md).
///
/// Each client has its own connection to the feed, and reads from it only when its last message is on its way. A slow
/// client therefore keeps nothing here: the feed leaves out what is old. Thread safety: none; one thread.
class FoxgloveClient : public std::enable_shared_from_this<FoxgloveClient> {
 public:
  static constexpr const char* kProtocols[] = {"foxglove.websocket.v1", "foxglove.sdk.v1"};

  FoxgloveClient(boost::asio::io_context& io, const DriveControl& drive, Wire& wire);
  /// Greets the client, and connects to the feed if there is one.
  void begin();
  /// Takes a text of the client, which is valid UTF-8.
  void take(const std::string& text);
  /// Tells that the last message is on its way.
  void written();
  /// Tells the state of the console, and connects to a feed that has appeared.
  void tell_state();
  /// Ends the client; the wire is not used any more.
  void end();

 private:
  void send(const std::string& json);
  void warn(const std::string& id, const std::string& text);
  void pump();
  void read_feed();
  void take_frame(const feed::FrameReader::Frame& frame);
  void lose_feed();
  void subscribe_at_feed();
  std::string state_message(std::uint32_t subscription) const;
  std::uint32_t id_of(std::uint32_t feed_channel) const;

  boost::asio::io_context& io_;
  const DriveControl& drive_;
  Wire* wire_;
  std::shared_ptr<FeedLink> feed_;
  bool reads_ = false, writes_ = false;
  std::uint32_t generation_ = 0;                          // of the feed; ids of channels are never used again
  std::set<std::uint32_t> channels_;                      // ids that are advertised
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  // id of the client -> id of the channel
  std::deque<std::string> control_;                       // JSON
  std::deque<std::string> data_;                          // of one frame of the feed
};

}  // namespace hueline::console
