#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>

#include "core/result.hpp"
#include "object_store/http.hpp"
#include "object_store/s3_access.hpp"
#include "object_store/s3_address.hpp"

namespace hueline::object_store {

/// What was asked of the storage so far.
struct S3Traffic {
  std::uint64_t requests = 0, fetched_bytes = 0, sent_bytes = 0, retries = 0;
};

/// Asks an object storage that speaks S3, and asks again if what fails may pass: with pauses that grow from 0.2 s to 10
/// s, for two minutes if the storage has answered before, otherwise for some seconds, because the address is more
/// likely wrong. Thread-safe.
class S3Client {
 public:
  /// `tell` gets a sentence when something fails and is asked for again; several threads may call it.
  S3Client(S3Access access, std::function<void(const std::string&)> tell);

  /// What is asked for.
  struct Question {
    std::string method = "GET";
    S3Address address = {};
    std::map<std::string, std::string> query = {};    ///< not encoded
    std::map<std::string, std::string> headers = {};  ///< besides those that every request has
    std::optional<std::pair<std::uint64_t, std::uint64_t>> range = {};
    std::span<std::byte> into = {};  ///< see HttpRequest
    std::optional<std::span<const std::byte>> content = {};
    bool may_be_missing = false;  ///< an answer with status 404 is no error
  };

  /// Returns the answer if its status is 200 to 299, 416 to a question with a range, or an allowed 404. Errors: Io,
  /// with the object, the status and what to do; Stopped.
  Result<HttpAnswer> ask(const Question& question, const std::stop_token& stop = {});

  S3Traffic traffic() const { return {requests_, fetched_bytes_, sent_bytes_, retries_}; }

 private:
  std::string url_of(const Question& question) const;
  Error refusal(const Question& question, const HttpAnswer& answer) const;
  Status pause(std::chrono::milliseconds time, const std::stop_token& stop) const;

  const S3Access access_;
  const HttpSigner signer_;
  const std::function<void(const std::string&)> tell_;
  Http http_;
  std::atomic<std::uint64_t> requests_ = 0, fetched_bytes_ = 0, sent_bytes_ = 0, retries_ = 0;
  std::atomic<bool> has_answered_ = false;
};

/// Returns the text of the first element of that name in an XML of S3, or nothing. `from` is moved behind it.
std::optional<std::string> xml_text(std::string_view xml, std::string_view name, std::size_t& from);

/// Returns the address as a text.
std::string name(const S3Address& address);

}  // namespace hueline::object_store
