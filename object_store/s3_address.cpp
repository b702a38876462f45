#include "object_store/s3_address.hpp"

#include <fmt/format.h>

#include <string_view>

namespace hueline::object_store {
namespace {

constexpr std::string_view kScheme = "s3://";
constexpr std::string_view kLettersAndDigits = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";

}  // namespace

Result<S3Address> S3Address::parse(const std::string& text) {
  const auto wrong = [&](const std::string& what) {
    return Error{ErrorCode::Invalid, fmt::format("{}: {}; an address is s3://BUCKET/KEY", text, what)};
  };
  if (!text.starts_with(kScheme)) return wrong("does not begin with s3://");
  const std::string rest = text.substr(kScheme.size());
  const auto slash = rest.find('/');
  S3Address out{rest.substr(0, slash), slash == std::string::npos ? "" : rest.substr(slash + 1)};
  if (out.bucket.empty()) return wrong("names no bucket");
  // The bucket becomes a part of the server's name.
  const std::string allowed = std::string(kLettersAndDigits) + ".-_";
  if (out.bucket.find_first_not_of(allowed) != std::string::npos)
    return wrong(fmt::format("the bucket \"{}\" has signs other than letters, digits, '.', '-' and '_'", out.bucket));
  return out;
}

}  // namespace hueline::object_store
