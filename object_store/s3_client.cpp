#include "object_store/s3_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string_view>

#include "core/printable.hpp"

namespace hueline::object_store {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kFirstPause(200), kLongestPause(10'000);
constexpr milliseconds kPatience(120'000), kPatienceAtFirst(3'000);
constexpr int kRangeNotSatisfiable = 416;

bool may_pass(int status) {
  return status == 408 || status == 429 || status == 500 || status == 502 || status == 503 || status == 504;
}

bool is_success(int status) { return status >= 200 && status < 300; }

/// Returns a text of XML without its entities.
std::string without_entities(std::string_view text) {
  static constexpr std::pair<std::string_view, char> kNamed[] = {
      {"amp", '&'}, {"lt", '<'}, {"gt", '>'}, {"quot", '"'}, {"apos", '\''}};
  std::string out;
  while (!text.empty()) {
    const auto begin = text.find('&');
    out += text.substr(0, begin);
    if (begin == std::string_view::npos) break;
    const auto end = text.find(';', begin);
    if (end == std::string_view::npos) return out += text.substr(begin);
    std::string_view word = text.substr(begin + 1, end - begin - 1);
    text.remove_prefix(end + 1);
    for (const auto& [name, sign] : kNamed)
      if (word == name) out += sign;
    if (!word.starts_with('#')) continue;
    const bool is_hex = word.starts_with("#x");
    word.remove_prefix(is_hex ? 2 : 1);
    unsigned number = 0;
    std::from_chars(word.data(), word.data() + word.size(), number, is_hex ? 16 : 10);
    if (number > 0 && number < 0x80) out += static_cast<char>(number);  // others come as they are, in UTF-8
  }
  return out;
}

}  // namespace

std::optional<std::string> xml_text(std::string_view xml, std::string_view name, std::size_t& from) {
  const std::string begin = fmt::format("<{}>", name), end = fmt::format("</{}>", name);
  const auto first = xml.find(begin, from);
  if (first == std::string_view::npos) return {};
  const auto last = xml.find(end, first);
  if (last == std::string_view::npos) return {};
  from = last + end.size();
  return without_entities(xml.substr(first + begin.size(), last - first - begin.size()));
}

std::string name(const S3Address& address) { return "s3://" + address.bucket + "/" + address.key; }

S3Client::S3Client(S3Access access, std::function<void(const std::string&)> tell)
    : access_(std::move(access)),
      signer_{access_.key_id, access_.secret, access_.token, access_.region},
      tell_(std::move(tell)),
      http_(access_.ca_bundle) {}

std::string S3Client::url_of(const Question& question) const {
  const S3Address& address = question.address;
  std::string url = access_.endpoint;
  // A certificate for *.s3.amazonaws.com does not cover names with more points.
  const bool is_host = url.empty() && address.bucket.find_first_of("._") == std::string::npos;
  if (url.empty()) {
    const char* domain = access_.region.starts_with("cn-") ? "amazonaws.com.cn" : "amazonaws.com";
    url = fmt::format("https://{}s3.{}.{}", is_host ? address.bucket + "." : "", access_.region, domain);
  }
  if (!is_host) url += "/" + address.bucket;
  // Without a key there is no slash behind the bucket: some storages sign the one without the other.
  if (is_host || !address.key.empty()) url += "/" + percent_encoded(address.key, true);
  char before = '?';
  for (const auto& [key, value] : question.query) {
    url += fmt::format("{}{}={}", before, percent_encoded(key, false), percent_encoded(value, false));
    before = '&';
  }
  return url;
}

Status S3Client::pause(milliseconds time, const std::stop_token& stop) const {
  std::mutex mutex;
  std::condition_variable_any nobody;
  std::unique_lock lock(mutex);
  nobody.wait_for(lock, stop, time, [] { return false; });
  return stop.stop_requested() ? Status(Error{ErrorCode::Stopped, "stopped"}) : Status();
}

Result<HttpAnswer> S3Client::ask(const Question& question, const std::stop_token& stop) {
  HttpRequest request;
  request.method = question.method;
  request.url = url_of(question);
  request.headers = question.headers;
  request.range = question.range;
  request.into = question.into;
  request.content = question.content;
  if (!access_.is_anonymous()) request.signer = &signer_;
  const auto begun = steady_clock::now();
  milliseconds wait = kFirstPause;
  for (int tries = 1;; ++tries) {
    ++requests_;
    const auto answer = http_.send(request, stop);
    std::string why;
    if (answer.ok()) {
      has_answered_ = has_answered_ || is_success(answer->status);
      fetched_bytes_ += answer->bytes + answer->text.size();
      if (question.content) sent_bytes_ += question.content->size();
      constexpr int kNotFound = 404;
      if (is_success(answer->status) || (question.range && answer->status == kRangeNotSatisfiable) ||
          (question.may_be_missing && answer->status == kNotFound))
        return answer;
      const Error error = refusal(question, *answer);
      if (!may_pass(answer->status)) return error;
      why = error.message;
    } else {
      if (answer.error().code == ErrorCode::Stopped) return answer.error();
      why = fmt::format("{}: {}", name(question.address), answer.error().message);
      if (answer.error().code == ErrorCode::Io) return Error{ErrorCode::Io, why};
    }
    const auto patience = has_answered_ ? kPatience : kPatienceAtFirst;
    if (steady_clock::now() - begun + wait > patience)
      return Error{ErrorCode::Io, fmt::format("{}; tried {} times: {}", why, tries,
                                              has_answered_ ? "begin again when the storage answers"
                                                            : "check the network, AWS_ENDPOINT_URL and AWS_REGION")};
    if (tries == 1) tell_(why + "; it is tried again");
    ++retries_;
    if (Status waited = pause(wait, stop); !waited.ok()) return waited.error();
    wait = std::min(2 * wait, kLongestPause);
  }
}

/// Returns what an answer says that is none, and what to do.
Error S3Client::refusal(const Question& question, const HttpAnswer& answer) const {
  std::size_t from = 0;
  const std::string code = printable(xml_text(answer.text, "Code", from).value_or(""));
  from = 0;
  const std::string words = printable(xml_text(answer.text, "Message", from).value_or(""));
  from = 0;
  std::string region = answer.header("x-amz-bucket-region");
  if (region.empty()) region = xml_text(answer.text, "Region", from).value_or("");
  const auto say = [&](const std::string& what) {
    return Error{ErrorCode::Io, fmt::format("{}: {} ({}{}{})", name(question.address), what, answer.status,
                                            code.empty() ? "" : " ", code)};
  };
  if (!region.empty() && region != access_.region && answer.status < 500 && answer.status != 404)
    return say(fmt::format("the bucket is in the region {0}: set AWS_REGION={0}", printable(region)));
  if (answer.status >= 300 && answer.status < 400)
    return say("the bucket is at another place: set AWS_REGION or AWS_ENDPOINT_URL to it");
  if (code == "NoSuchBucket")
    return say(fmt::format("there is no bucket {} at {}", question.address.bucket,
                           access_.endpoint.empty() ? "AWS" : access_.endpoint));
  if (answer.status == 404) return say("there is no such object");
  if (answer.status == 412) return say("the object was replaced while it was read: begin again");
  if (code == "RequestTimeTooSkewed") return say("the clock of this computer is wrong: set it");
  if (code == "ExpiredToken" || code == "InvalidToken")
    return say(fmt::format("the temporary key of {} is not valid any more: get another one", access_.from));
  if (code == "SignatureDoesNotMatch")
    return say(fmt::format("the secret does not belong to the access key {}: check {}", access_.key_id, access_.from));
  if (code == "InvalidAccessKeyId")
    return say(fmt::format("the storage does not know the access key {}: check {}, and AWS_ENDPOINT_URL",
                           access_.key_id, access_.from));
  if (answer.status == 401 || answer.status == 403)
    return say(access_.is_anonymous()
                   ? "not everybody has the right: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or AWS_PROFILE"
                   : fmt::format("the access key {} of {} has not the right: ask whoever gives the rights",
                                 access_.key_id, access_.from));
  return say("the storage answers" + (words.empty() ? " with an error" : ": " + words));
}

}  // namespace hueline::object_store
