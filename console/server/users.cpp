#include "console/server/users.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "console/server/json_fields.hpp"

namespace hueline::console {
namespace {

using nlohmann::ordered_json;

// The time and memory of a check: 64 MB and two passes, a tenth of a second on a vehicle's computer.
constexpr auto kOperations = crypto_pwhash_OPSLIMIT_INTERACTIVE;
constexpr auto kMemory = crypto_pwhash_MEMLIMIT_INTERACTIVE;

std::string hex(const unsigned char* bytes, std::size_t size) {
  std::string out(2 * size + 1, '\0');
  sodium_bin2hex(out.data(), out.size(), bytes, size);
  out.pop_back();
  return out;
}

std::string token_hash(const std::string& token) {
  std::array<unsigned char, crypto_generichash_BYTES> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(token.data()), token.size(),
                     nullptr, 0);
  return hex(hash.data(), hash.size());
}

bool is_right(const std::string& hash, const std::string& password) {
  return crypto_pwhash_str_verify(hash.c_str(), password.data(), password.size()) == 0;
}

Result<std::string> hash_of(const std::string& password) {
  std::array<char, crypto_pwhash_STRBYTES> out{};
  if (crypto_pwhash_str_alg(out.data(), password.data(), password.size(), kOperations, kMemory,
                            crypto_pwhash_ALG_ARGON2ID13) != 0)
    return Error{ErrorCode::Exhausted, "there is no memory for the hash of a password (64 MB)"};
  return std::string(out.data());
}

}  // namespace

const char* name(Role role) { return role == Role::Operator ? "operator" : "viewer"; }

std::optional<Role> role_of(const std::string& word) {
  if (word == "operator") return Role::Operator;
  if (word == "viewer") return Role::Viewer;
  return {};
}

bool is_plain_name(const std::string& name) {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  };
  return !name.empty() && name.size() <= 64 && is_letter(name.front()) &&
         std::ranges::all_of(name, [&](char c) { return is_letter(c) || c == '.' || c == '_' || c == '-'; });
}

std::string random_text(std::size_t bytes) {
  std::vector<unsigned char> random(bytes);
  randombytes_buf(random.data(), random.size());
  return hex(random.data(), random.size());
}

bool are_same(const std::string& a, const std::string& b) {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

Result<Users> Users::load(const std::filesystem::path& file) {
  Users out;
  std::error_code failed;
  if (!std::filesystem::exists(file, failed)) return out;
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in) return io_error(file.string() + " cannot be read", errno);
  const auto wrong = [&](const std::string& why) {
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: {}; make the users again with `hueline-console user add`", file.string(), why)};
  };
  const ordered_json json = ordered_json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("users") || !json["users"].is_array()) return wrong("it lists no users");
  for (const auto& one : json["users"]) {
    const auto field = [&](const char* key) { return text_in(one, key); };
    const auto role = role_of(field("role"));
    if (!is_plain_name(field("name")) || !role || field("password").empty())
      return wrong("a user needs name, role (operator or viewer) and password");
    out.users_.push_back({field("name"), *role, field("password"), field("token")});
  }
  return out;
}

Status Users::save(const std::filesystem::path& file) const {
  auto list = ordered_json::array();
  for (const User& user : users_) {
    list.push_back({{"name", user.name}, {"role", name(user.role)}, {"password", user.password_hash}});
    if (!user.token_hash.empty()) list.back()["token"] = user.token_hash;
  }
  const std::string text = ordered_json{{"users", list}}.dump(2) + "\n";
  const std::filesystem::path fresh = file.string() + ".new";
  const int fd = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return io_error(fresh.string() + " cannot be written", errno);
  const bool done = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(fd) == 0;
  const int why = errno;
  ::close(fd);
  if (!done) return io_error(fresh.string() + " cannot be written", why);
  if (std::rename(fresh.c_str(), file.c_str()) != 0) return io_error(file.string() + " cannot be replaced", errno);
  return {};
}

Status Users::add(const std::string& name, Role role, const std::string& password) {
  if (!is_plain_name(name))
    return Error{ErrorCode::Invalid, fmt::format("the name of a user has 1 to 64 letters, digits, '.', '_' or '-' and "
                                                 "begins with a letter or digit")};
  if (password.size() < kLeastPassword || password.size() > kMostPassword)
    return Error{ErrorCode::Invalid,
                 fmt::format("a password has {} to {} bytes: choose another one", kLeastPassword, kMostPassword)};
  auto hash = hash_of(password);
  if (!hash.ok()) return hash.error();
  std::erase_if(users_, [&](const User& user) { return user.name == name; });
  users_.push_back({name, role, std::move(*hash), {}});
  return {};
}

Result<std::string> Users::make_token(const std::string& name) {
  for (User& user : users_) {
    if (user.name != name) continue;
    std::string token = random_text(32);
    user.token_hash = token_hash(token);
    return token;
  }
  return Error{ErrorCode::Invalid, fmt::format("there is no user '{}': add it first", name)};
}

Status Users::remove(const std::string& name) {
  if (std::erase_if(users_, [&](const User& user) { return user.name == name; }) > 0) return {};
  return Error{ErrorCode::Invalid, fmt::format("there is no user '{}': `hueline-console user list` shows them", name)};
}

const User* Users::find(const std::string& name) const {
  const auto found = std::ranges::find(users_, name, &User::name);
  return found == users_.end() ? nullptr : &*found;
}

const User* Users::check(const std::string& name, const std::string& password) const {
  if (password.size() > kMostPassword) return nullptr;
  for (const User& user : users_)
    if (user.name == name) return is_right(user.password_hash, password) ? &user : nullptr;
  // As long as for a name that exists.
  static const Result<std::string> kNobody = hash_of("nobody has this password");
  if (kNobody.ok()) (void)is_right(*kNobody, password);
  return nullptr;
}

const User* Users::of_token(const std::string& token) const {
  if (token.size() != 64) return nullptr;
  const std::string hash = token_hash(token);
  for (const User& user : users_)
    if (!user.token_hash.empty() && are_same(user.token_hash, hash)) return &user;
  return nullptr;
}

}  // namespace hueline::console
