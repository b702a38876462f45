#pragma once

#include <string>

#include "core/result.hpp"

namespace hueline::object_store {

/// The place of an object: s3://BUCKET/KEY.
struct S3Address {
  std::string bucket;
  std::string key;  ///< without a slash at its beginning; empty: the bucket itself

  /// Reads an address. Errors: Invalid, with what is wrong.
  static Result<S3Address> parse(const std::string& text);
};

}  // namespace hueline::object_store
