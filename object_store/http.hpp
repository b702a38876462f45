#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/mutex.hpp"
#include "core/result.hpp"

namespace hueline::object_store {

/// Who signs a request, by AWS's Signature Version 4.
struct HttpSigner {
  std::string key_id, secret, token, region;
};

/// A request of HTTP.
struct HttpRequest {
  std::string method = "GET";
  std::string url;  ///< percent-encoded; the names of its query in the order of the alphabet
  std::map<std::string, std::string> headers;
  /// The first byte that is asked for, and how many.
  std::optional<std::pair<std::uint64_t, std::uint64_t>> range;
  const HttpSigner* signer = nullptr;  ///< null: unsigned
  std::optional<std::span<const std::byte>> content;
  /// Where the content of an answer with status 206 goes, which has at most so many bytes. Other content goes into
  /// HttpAnswer::text.
  std::span<std::byte> into;
};

/// An answer of HTTP, whatever its status is.
struct HttpAnswer {
  int status = 0;
  std::map<std::string, std::string> headers;  ///< names in small letters
  std::size_t bytes = 0;                       ///< of HttpRequest::into
  std::string text;

  /// Returns the value of a header; empty if there is none.
  std::string header(const std::string& name) const;
};

/// Sends requests by libcurl, over connections that it keeps. Thread-safe.
class Http {
 public:
  /// `ca_bundle`: file of the authorities that vouch for servers; empty: the system's.
  explicit Http(std::string ca_bundle);
  ~Http();
  Http(const Http&) = delete;
  Http& operator=(const Http&) = delete;

  /// Waits for the answer: 10 s for a connection, and as long as a byte comes within 30 s. Errors: Unavailable if the
  /// network or the server fails in a way that may pass; Io if it will not; Truncated if the answer ends early;
  /// Stopped.
  Result<HttpAnswer> send(const HttpRequest& request, const std::stop_token& stop);

 private:
  struct Handle;
  std::unique_ptr<Handle> take_handle();

  const std::string ca_bundle_;
  Mutex mutex_;
  std::vector<std::unique_ptr<Handle>> idle_ HUELINE_GUARDED_BY(mutex_);
};

}  // namespace hueline::object_store
