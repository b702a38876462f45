#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"
#include "drivers/transport/file_descriptor.hpp"

namespace hueline::drivers {

/// Asks a device questions over TCP without ever waiting: the questions in turn over one connection, each answered by
/// one line; or one question, answered by all that comes until the device closes the connection.
/// Thread safety: none; one thread calls all functions.
class TextExchange {
 public:
  /// What is asked, and of whom.
  struct Config {
    std::string address;  ///< IPv4
    std::uint16_t port = 0;
    std::vector<std::string> questions;            ///< as they are sent, with the ends of their lines
    bool ends_by_close = false;                    ///< the answer ends when the connection does; there is one question
    nanoseconds timeout{std::chrono::seconds(2)};  ///< for everything
  };
  /// Begins at the time `now` of any steady clock. What fails at once is said by the first step().
  TextExchange(Config config, HostTime now);

  /// Goes on as far as possible. Returns the answers, without the ends of their lines, when all are there; nothing
  /// while they are not. After a result the object is used up. Errors: Unavailable (cannot be reached), TimedOut,
  /// Disconnected (before the last answer), Exhausted (an answer of more than 4 MB).
  std::optional<Result<std::vector<std::string>>> step(HostTime now);

 private:
  std::optional<Error> send();
  Error failed(ErrorCode code, std::string_view why) const;

  Config config_;
  HostTime began_;
  FileDescriptor socket_;
  std::optional<Error> error_;
  bool is_connected_ = false;
  std::size_t sent_ = 0;  // bytes of the present question
  std::string received_;  // since the last whole answer
  std::vector<std::string> answers_;
};

/// Returns the question of HTTP for a page. The answer ends by close.
std::string http_question(std::string_view host, std::string_view page);
/// Returns the body of an answer of HTTP. Errors: Malformed (not HTTP), Unavailable (another status than 200, which the
/// message names).
Result<std::string> http_body(std::string_view answer);

}  // namespace hueline::drivers
