#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/result.hpp"

namespace hueline::object_store {

/// Where the object storage is, and who asks it: the environment variables and files of the AWS command line, which
/// other clients of object storage read too.
struct S3Access {
  std::string key_id, secret, token;  ///< all empty: objects that everybody may read; `token` of temporary keys alone
  std::string from;  ///< where the keys are from, for messages: "AWS_ACCESS_KEY_ID", "profile ... of ..."
  std::string region = "us-east-1";
  std::string endpoint;   ///< "https://host:port" of a storage that is not AWS's; empty: AWS
  std::string ca_bundle;  ///< file of the authorities that vouch for the server; empty: those of the system

  bool is_anonymous() const { return key_id.empty(); }

  /// Returns the value of an environment variable, or nothing. Replaceable for tests.
  using Environment = std::function<std::optional<std::string>(const char* name)>;

  /// Reads AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN, AWS_REGION, AWS_DEFAULT_REGION,
  /// AWS_ENDPOINT_URL_S3, AWS_ENDPOINT_URL, AWS_CA_BUNDLE, and what these do not say from the profile AWS_PROFILE
  /// ("default" without it) of the files AWS_SHARED_CREDENTIALS_FILE (~/.aws/credentials) and AWS_CONFIG_FILE
  /// (~/.aws/config). Keys of the environment go before those of a profile, unless AWS_PROFILE is set and they are not.
  /// Errors: Invalid if one half of a pair is missing, or AWS_PROFILE names no profile; Unsupported if a profile has
  /// its keys from elsewhere; those of read_input() but for files that do not exist. No message has a secret.
  static Result<S3Access> read(const Environment& environment);
};

}  // namespace hueline::object_store
