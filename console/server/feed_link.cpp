#include "console/server/feed_link.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <utility>

#include "core/local_socket.hpp"

namespace hueline::console {

namespace asio = boost::asio;

Result<std::shared_ptr<FeedLink>> FeedLink::connect(asio::io_context& io, const std::filesystem::path& path) {
  auto connected = connect_locally(path);
  if (!connected.ok()) return connected.error();
  Socket socket(io);
  boost::system::error_code failed;
  socket.assign(asio::local::stream_protocol(), connected->get(), failed);
  if (failed) return Error{ErrorCode::Io, path.string() + ": " + failed.message()};
  (void)connected->release();
  return std::shared_ptr<FeedLink>(new FeedLink(std::move(socket)));
}

void FeedLink::read(OnFrame on_frame, OnEnd on_end) {
  on_frame_ = std::move(on_frame);
  on_end_ = std::move(on_end);
  auto next = reader_.next();
  if (!next.ok() || is_over_) {
    asio::post(socket_.get_executor(), [self = shared_from_this()] { self->end(); });
  } else if (*next) {
    // Not at once, so that a chain of frames does not grow the stack.
    asio::post(socket_.get_executor(), [self = shared_from_this(), frame = std::move(**next)] {
      if (const auto taker = std::exchange(self->on_frame_, {})) taker(frame);
    });
  } else {
    read_more();
  }
}

void FeedLink::read_more() {
  socket_.async_read_some(asio::buffer(bytes_),
                          [self = shared_from_this()](boost::system::error_code failed, std::size_t got) {
                            if (failed) return self->end();
                            self->reader_.add({self->bytes_.data(), got});
                            auto next = self->reader_.next();
                            if (!next.ok()) return self->end();
                            if (!*next) return self->read_more();
                            if (const auto taker = std::exchange(self->on_frame_, {})) taker(**next);
                          });
}

void FeedLink::end() {
  is_over_ = true;
  on_frame_ = {};
  if (const auto told = std::exchange(on_end_, {})) told();
}

void FeedLink::close() {
  on_frame_ = {};
  on_end_ = {};
  is_over_ = true;
  boost::system::error_code ignored;
  socket_.close(ignored);
}

void FeedLink::send(feed::Kind kind, const std::string& content) {
  constexpr std::size_t kMostWaiting = 1000;  // a feed that takes nothing is as good as ended
  if (is_over_ || waiting_.size() > kMostWaiting) return;
  waiting_.push_back(feed::frame(kind, content));
  if (waiting_.size() == 1) write_more();
}

void FeedLink::write_more() {
  asio::async_write(socket_, asio::buffer(waiting_.front()),
                    [self = shared_from_this()](boost::system::error_code failed, std::size_t) {
                      self->waiting_.pop_front();
                      if (failed)
                        self->waiting_.clear();
                      else if (!self->waiting_.empty())
                        self->write_more();
                    });
}

}  // namespace hueline::console
