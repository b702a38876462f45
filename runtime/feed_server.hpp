#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/feed_protocol.hpp"
#include "core/local_socket.hpp"

namespace hueline::runtime {

/// The socket of the live feed and its listeners. Each listener gets the channels that it asks for. One that reads too
/// slowly keeps the newest messages of each channel only, is told how many it lost, and costs bounded memory.
/// Thread safety: none; the feed's thread calls all functions. None of them waits, except wait() for the given time.
class FeedServer {
 public:
  /// A channel of the feed.
  struct Channel {
    std::string topic;
    std::string encoding;         ///< of messages: "protobuf" or "json"
    std::string schema_name;      ///< such as "foxglove.Log"
    std::string schema_encoding;  ///< "protobuf" (schema is a FileDescriptorSet) or "jsonschema"
    std::string schema;
    std::size_t depth = 1;  ///< messages that wait for a slow listener at most; older ones are lost
    bool is_kept = false;   ///< a new listener of the channel gets its last message at once
  };
  static constexpr std::size_t kMostListeners = 128;

  /// Answers a command of a listener: an error, which is told to the listener, or ok.
  using OnCommand = std::function<Status(const std::string& command, const std::string& note)>;
  /// Gives the messages with which a new listener of a channel begins, in their order.
  using OnSubscribe = std::function<std::vector<std::string>(std::size_t channel)>;

  /// `hello` is the JSON that each listener gets first. Errors: those of listen_locally().
  static Result<std::unique_ptr<FeedServer>> create(const std::filesystem::path& path, std::string hello,
                                                    OnCommand on_command, OnSubscribe on_subscribe);
  /// Ends all connections and removes the socket.
  ~FeedServer();

  /// Adds a channel and returns its id.
  std::size_t add(Channel channel);
  /// Returns whether a listener wants the channel.
  bool is_wanted(std::size_t channel) const;
  /// Gives a message to the listeners of the channel.
  void publish(std::size_t channel, std::int64_t unix_ns, std::string_view bytes);
  /// Waits at most `milliseconds` for something to do, and does it: accepts, reads and writes.
  void wait(int milliseconds);
  /// Returns how many messages listeners have lost.
  std::uint64_t lost() const { return lost_; }

 private:
  struct Listener {
    FileDescriptor socket;
    feed::FrameReader reader{feed::kMostFromListener};
    std::set<std::size_t> channels;
    std::deque<std::string> control;                                                // hello, channels, answers
    std::map<std::size_t, std::deque<std::shared_ptr<const std::string>>> waiting;  // frames by channel
    std::size_t next = 0;                                                           // the channel whose turn it is
    std::shared_ptr<const std::string> now;                                         // the frame that is being written
    std::size_t written = 0;
    std::uint64_t lost = 0, told_lost = 0;
    bool is_over = false;
  };
  FeedServer(std::filesystem::path path, FileDescriptor socket, std::string hello, OnCommand on_command,
             OnSubscribe on_subscribe);
  void accept_all();
  void read(Listener& listener);
  void take(Listener& listener, const feed::FrameReader::Frame& frame);
  void subscribe(Listener& listener, const std::set<std::size_t>& channels);
  void queue(Listener& listener, std::size_t channel, std::shared_ptr<const std::string> frame);
  void write(Listener& listener);
  bool take_next(Listener& listener);
  std::string describe(std::size_t channel) const;

  const std::filesystem::path path_;
  const FileDescriptor socket_;
  const std::string hello_;
  const OnCommand on_command_;
  const OnSubscribe on_subscribe_;
  std::vector<Channel> channels_;
  std::map<std::size_t, std::shared_ptr<const std::string>> kept_;
  std::vector<std::unique_ptr<Listener>> listeners_;
  std::uint64_t lost_ = 0;
};

}  // namespace hueline::runtime
