#include "object_store/s3_access.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string_view>
#include <system_error>

#include "core/input_file.hpp"

namespace hueline::object_store {
namespace {

using Section = std::map<std::string, std::string>;

std::string trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(kBlank) - begin + 1));
}

/// Reads "[name]" and "key = value". Indented lines are the settings of a service, which are not needed here.
std::map<std::string, Section> sections_of(std::string_view text) {
  std::map<std::string, Section> out;
  Section* present = nullptr;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::string plain = trimmed(line);
    if (plain.empty() || plain.front() == '#' || plain.front() == ';') continue;
    if (plain.front() == '[') {
      present = &out[trimmed(std::string_view(plain).substr(1, plain.find(']') - 1))];
      continue;
    }
    const auto equals = plain.find('=');
    const bool is_indented = line.front() == ' ' || line.front() == '\t';
    if (present == nullptr || equals == std::string::npos || is_indented) continue;
    (*present)[trimmed(std::string_view(plain).substr(0, equals))] =
        trimmed(std::string_view(plain).substr(equals + 1));
  }
  return out;
}

/// A profile of the two files.
struct Profile {
  std::string name, credentials_file;
  bool is_there = false;
  Section values;

  std::string value(const char* key) const {
    const auto found = values.find(key);
    return found == values.end() ? std::string() : found->second;
  }
};

Status add_file(Profile& profile, const std::string& file, const std::string& section) {
  std::error_code unknown;
  if (file.empty() || !std::filesystem::exists(file, unknown)) return {};
  constexpr std::uint64_t kLargest = 1'000'000;  // bytes
  const auto text = read_input(file, kLargest, "a file of profiles");
  if (!text.ok()) return text.error();
  const auto sections = sections_of(*text);
  const auto found = sections.find(section);
  if (found == sections.end()) return {};
  profile.is_there = true;
  profile.values.insert(found->second.begin(), found->second.end());
  return {};
}

}  // namespace

Result<S3Access> S3Access::read(const Environment& environment) {
  const auto variable = [&](const char* name) { return environment(name).value_or(""); };
  const auto first = [&](std::initializer_list<const char*> names, std::string otherwise) {
    for (const char* name : names)
      if (std::string value = variable(name); !value.empty()) return value;
    return otherwise;
  };
  const std::string home = variable("HOME");
  const auto in_home = [&](const char* name) { return home.empty() ? std::string() : home + "/.aws/" + name; };
  const std::string asked_profile = variable("AWS_PROFILE");

  Profile profile;
  profile.name = asked_profile.empty() ? "default" : asked_profile;
  profile.credentials_file = first({"AWS_SHARED_CREDENTIALS_FILE"}, in_home("credentials"));
  const std::string config_file = first({"AWS_CONFIG_FILE"}, in_home("config"));
  if (Status read = add_file(profile, profile.credentials_file, profile.name); !read.ok()) return read.error();
  // Profiles but "default" have another name in that file.
  const std::string section = profile.name == "default" ? profile.name : "profile " + profile.name;
  if (Status read = add_file(profile, config_file, section); !read.ok()) return read.error();
  if (!asked_profile.empty() && !profile.is_there)
    return Error{ErrorCode::Invalid, fmt::format("AWS_PROFILE is \"{}\", and neither {} nor {} has that profile",
                                                 asked_profile, profile.credentials_file, config_file)};

  S3Access out;
  out.key_id = variable("AWS_ACCESS_KEY_ID");
  out.secret = variable("AWS_SECRET_ACCESS_KEY");
  out.token = variable("AWS_SESSION_TOKEN");
  out.from = "AWS_ACCESS_KEY_ID";
  if (out.key_id.empty() != out.secret.empty())
    return Error{ErrorCode::Invalid,
                 "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY belong together: one of them is not set"};
  if (out.key_id.empty()) {
    out.from = fmt::format("the profile \"{}\" of {}", profile.name, profile.credentials_file);
    out.key_id = profile.value("aws_access_key_id");
    out.secret = profile.value("aws_secret_access_key");
    out.token = profile.value("aws_session_token");
    if (out.key_id.empty() != out.secret.empty())
      return Error{ErrorCode::Invalid,
                   out.from + ": aws_access_key_id and aws_secret_access_key belong together: one of them is missing"};
    for (const char* key :
         {"role_arn", "sso_session", "sso_account_id", "credential_process", "web_identity_token_file"})
      if (out.key_id.empty() && !profile.value(key).empty())
        return Error{
            ErrorCode::Unsupported,
            fmt::format("the profile \"{}\" has its keys by {}, which this program does not ask for them: set "
                        "AWS_ACCESS_KEY_ID and the like, which `aws configure export-credentials --format env` "
                        "prints",
                        profile.name, key)};
  }
  if (out.key_id.empty()) out.token.clear();
  out.region = first({"AWS_REGION", "AWS_DEFAULT_REGION"}, profile.value("region"));
  if (out.region.empty()) out.region = "us-east-1";
  out.endpoint = first({"AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"}, profile.value("endpoint_url"));
  while (out.endpoint.ends_with('/')) out.endpoint.pop_back();
  if (!out.endpoint.empty() && !out.endpoint.starts_with("http://") && !out.endpoint.starts_with("https://"))
    return Error{ErrorCode::Invalid,
                 fmt::format("AWS_ENDPOINT_URL is \"{}\": it begins with http:// or https://", out.endpoint)};
  out.ca_bundle = first({"AWS_CA_BUNDLE"}, profile.value("ca_bundle"));
  return out;
}

}  // namespace hueline::object_store
