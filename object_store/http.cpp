#include "object_store/http.hpp"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <string_view>
#include <utility>

namespace hueline::object_store {
namespace {

constexpr std::size_t kMostText = std::size_t{64} << 20;  // bytes; a list of 1000 names has a few hundred kilobytes

/// One exchange, as libcurl's callbacks see it.
struct Exchange {
  const HttpRequest& request;
  const std::stop_token& stop;
  HttpAnswer answer;
  bool is_too_long = false;
};

std::size_t take_header(char* text, std::size_t size, std::size_t count, void* user) {
  auto& exchange = *static_cast<Exchange*>(user);
  std::string_view line(text, size * count);
  if (line.starts_with("HTTP/")) {
    exchange.answer = {};  // of an answer before, such as "100 Continue"
    const auto space = line.find(' ');
    if (space != std::string_view::npos) exchange.answer.status = std::atoi(std::string(line.substr(space)).c_str());
    return size * count;
  }
  while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.remove_suffix(1);
  const auto colon = line.find(':');
  if (colon == std::string_view::npos) return size * count;
  std::string name(line.substr(0, colon));
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  line.remove_prefix(colon + 1);
  while (!line.empty() && std::isspace(static_cast<unsigned char>(line.front())) != 0) line.remove_prefix(1);
  exchange.answer.headers[std::move(name)] = line;
  return size * count;
}

std::size_t take_content(char* text, std::size_t size, std::size_t count, void* user) {
  auto& exchange = *static_cast<Exchange*>(user);
  HttpAnswer& answer = exchange.answer;
  const std::size_t bytes = size * count;
  constexpr int kPartialContent = 206;
  if (answer.status == kPartialContent && !exchange.request.into.empty()) {
    exchange.is_too_long = bytes > exchange.request.into.size() - answer.bytes;
    if (exchange.is_too_long) return 0;
    std::memcpy(exchange.request.into.data() + answer.bytes, text, bytes);
    answer.bytes += bytes;
    return bytes;
  }
  exchange.is_too_long = bytes > kMostText - answer.text.size();
  if (exchange.is_too_long) return 0;
  answer.text.append(text, bytes);
  return bytes;
}

int is_stopped(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<Exchange*>(user)->stop.stop_requested() ? 1 : 0;
}

/// Returns whether another try may go better.
bool may_pass(CURLcode code) {
  static constexpr std::array kPassing{CURLE_COULDNT_RESOLVE_PROXY,
                                       CURLE_COULDNT_RESOLVE_HOST,
                                       CURLE_COULDNT_CONNECT,
                                       CURLE_OPERATION_TIMEDOUT,
                                       CURLE_SSL_CONNECT_ERROR,
                                       CURLE_GOT_NOTHING,
                                       CURLE_SEND_ERROR,
                                       CURLE_RECV_ERROR,
                                       CURLE_HTTP2,
                                       CURLE_HTTP2_STREAM,
                                       CURLE_WEIRD_SERVER_REPLY};
  return std::ranges::find(kPassing, code) != kPassing.end();
}

using Headers = std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)>;

Headers headers_of(const HttpRequest& request) {
  Headers out(nullptr, curl_slist_free_all);
  const auto add = [&](const std::string& line) {
    curl_slist* longer = curl_slist_append(out.get(), line.c_str());
    if (longer == nullptr) throw std::bad_alloc();
    (void)out.release();
    out.reset(longer);
  };
  for (const auto& [name, value] : request.headers) add(name + ": " + value);
  if (request.signer == nullptr) return out;
  // A question has no content; who sends some says its hash.
  if (!request.headers.contains("x-amz-content-sha256")) add("x-amz-content-sha256: UNSIGNED-PAYLOAD");
  if (!request.signer->token.empty()) add("x-amz-security-token: " + request.signer->token);
  return out;
}

}  // namespace

std::string HttpAnswer::header(const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? std::string() : found->second;
}

struct Http::Handle {
  std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> curl{curl_easy_init(), curl_easy_cleanup};
  std::array<char, CURL_ERROR_SIZE> words{};
};

Http::Http(std::string ca_bundle) : ca_bundle_(std::move(ca_bundle)) { curl_global_init(CURL_GLOBAL_DEFAULT); }
Http::~Http() = default;

std::unique_ptr<Http::Handle> Http::take_handle() {
  const Lock lock(mutex_);
  if (idle_.empty()) return std::make_unique<Handle>();
  std::unique_ptr<Handle> out = std::move(idle_.back());
  idle_.pop_back();
  return out;
}

Result<HttpAnswer> Http::send(const HttpRequest& request, const std::stop_token& stop) {
  std::unique_ptr<Handle> handle = take_handle();
  CURL* curl = handle->curl.get();
  if (curl == nullptr) return Error{ErrorCode::Io, "libcurl has no memory for a request"};
  Exchange exchange{request, stop, {}, false};
  curl_easy_reset(curl);  // keeps its connections
  handle->words.fill('\0');
  const Headers headers = headers_of(request);
  const std::string range =
      request.range ? fmt::format("{}-{}", request.range->first, request.range->first + request.range->second - 1) : "";
  curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, handle->words.data());
  curl_easy_setopt(curl, CURLOPT_URL, request.url.c_str());
  curl_easy_setopt(curl, CURLOPT_PATH_AS_IS, 1L);
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, 10L);
  curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, 30L);
  curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, request.method.c_str());
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
  if (request.method == "HEAD") curl_easy_setopt(curl, CURLOPT_NOBODY, 1L);
  if (request.content) {
    curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.content->size()));
    curl_easy_setopt(curl, CURLOPT_POSTFIELDS, reinterpret_cast<const char*>(request.content->data()));
  }
  if (!range.empty()) curl_easy_setopt(curl, CURLOPT_RANGE, range.c_str());
  if (!ca_bundle_.empty()) curl_easy_setopt(curl, CURLOPT_CAINFO, ca_bundle_.c_str());
  const std::string provider = request.signer == nullptr ? "" : fmt::format("aws:amz:{}:s3", request.signer->region);
  if (request.signer != nullptr) {
    curl_easy_setopt(curl, CURLOPT_AWS_SIGV4, provider.c_str());
    curl_easy_setopt(curl, CURLOPT_USERNAME, request.signer->key_id.c_str());
    curl_easy_setopt(curl, CURLOPT_PASSWORD, request.signer->secret.c_str());
  }
  curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, take_header);
  curl_easy_setopt(curl, CURLOPT_HEADERDATA, &exchange);
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, take_content);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &exchange);
  curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, is_stopped);
  curl_easy_setopt(curl, CURLOPT_XFERINFODATA, &exchange);
  const CURLcode code = curl_easy_perform(curl);
  const std::string words = handle->words[0] != '\0' ? handle->words.data() : curl_easy_strerror(code);
  {
    const Lock lock(mutex_);
    idle_.push_back(std::move(handle));
  }
  if (code == CURLE_OK) return std::move(exchange.answer);
  if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stopped"};
  if (exchange.is_too_long) return Error{ErrorCode::Io, "the server sends more than was asked for"};
  if (code == CURLE_PARTIAL_FILE) return Error{ErrorCode::Truncated, "the answer ends early: " + words};
  return Error{may_pass(code) ? ErrorCode::Unavailable : ErrorCode::Io, words};
}

}  // namespace hueline::object_store
