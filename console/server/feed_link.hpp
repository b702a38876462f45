#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/feed_protocol.hpp"
#include "core/result.hpp"

namespace hueline::console {

/// A connection to the live feed of a drive (core/feed_protocol.hpp). It reads when it is asked to, so that whoever
/// cannot take more lets the feed leave out what is old. Thread safety: none; all on the thread of `io`.
class FeedLink : public std::enable_shared_from_this<FeedLink> {
 public:
  using OnFrame = std::function<void(const feed::FrameReader::Frame&)>;
  using OnEnd = std::function<void()>;

  /// Connects. Errors: those of connect_locally().
  static Result<std::shared_ptr<FeedLink>> connect(boost::asio::io_context& io, const std::filesystem::path& socket);
  /// Asks for the next frame: `on_frame` is called once with it, or `on_end` once if the feed has ended. Not to be
  /// called again before.
  void read(OnFrame on_frame, OnEnd on_end);
  /// Sends a frame to the feed.
  void send(feed::Kind kind, const std::string& content);
  /// Ends the connection; nothing is called any more.
  void close();

 private:
  using Socket = boost::asio::local::stream_protocol::socket;
  explicit FeedLink(Socket socket) : socket_(std::move(socket)) {}
  void read_more();
  void write_more();
  void end();

  Socket socket_;
  feed::FrameReader reader_{feed::kMostFromFeed};
  std::array<char, 65536> bytes_{};
  std::deque<std::string> waiting_;
  bool is_over_ = false;
  OnFrame on_frame_;
  OnEnd on_end_;
};

}  // namespace hueline::console
