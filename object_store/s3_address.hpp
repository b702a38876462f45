#pragma once

#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hueline::object_store {

/// The place of an object: s3://BUCKET/KEY.
struct S3Address {
  std::string bucket;
  std::string key;  ///< without a slash at its beginning; empty: the bucket itself

  /// Reads an address. Errors: Invalid, with what is wrong.
  static Result<S3Address> parse(const std::string& text);
};

/// Returns the text with every byte as %XX but letters, digits, "-._~" and, if `keeps_slashes`, "/", as signatures of
/// AWS want it. Source: "Create a signed AWS API request", UriEncode().
std::string percent_encoded(std::string_view text, bool keeps_slashes);

}  // namespace hueline::object_store
