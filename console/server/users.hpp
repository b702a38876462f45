#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hueline::console {

/// What somebody may do.
enum class Role { Viewer, Operator };
/// Returns the word of it: "viewer", "operator".
const char* name(Role role);
/// Reads the word.
std::optional<Role> role_of(const std::string& word);

/// Returns whether the name may be a user, a drive or a rig: 1 to 64 characters of A-Z a-z 0-9 . _ -, the first of
/// them a letter or a digit.
bool is_plain_name(const std::string& name);

/// Somebody who may use the console.
struct User {
  std::string name;
  Role role = Role::Viewer;
  std::string password_hash;  ///< Argon2id, as libsodium's crypto_pwhash_str() writes it
  /// Hash (BLAKE2b, hexadecimal) of a token for programs that cannot log in, such as Foxglove; empty: none. A token has
  /// 256 random bits, so its hash needs neither salt nor time.
  std::string token_hash;
};

/// The users of a console, in a JSON file that its owner alone may read. Thread safety: none.
class Users {
 public:
  static constexpr std::size_t kLeastPassword = 8, kMostPassword = 256;  ///< bytes

  /// Reads the file; no file means no users. Errors: Io; Malformed, with what is wrong.
  static Result<Users> load(const std::filesystem::path& file);
  /// Writes the file with rights for its owner only, at once or not at all.
  Status save(const std::filesystem::path& file) const;

  /// Adds a user or replaces the one of the same name. Error: Invalid.
  Status add(const std::string& name, Role role, const std::string& password);
  /// Makes a token for the user and returns it; only its hash is kept. Error: Invalid if there is no such user.
  Result<std::string> make_token(const std::string& name);
  /// Removes a user. Error: Invalid if there is no such user.
  Status remove(const std::string& name);
  /// Returns the user of that name, or null.
  const User* find(const std::string& name) const;
  const std::vector<User>& all() const { return users_; }
  /// Returns the user if the password is right. Takes about as long if the name is wrong.
  const User* check(const std::string& name, const std::string& password) const;
  /// Returns the user of a token, or null.
  const User* of_token(const std::string& token) const;
  bool are_none() const { return users_.empty(); }

 private:
  std::vector<User> users_;
};

/// Returns `bytes` random bytes in hexadecimal.
std::string random_text(std::size_t bytes);
/// Compares two secrets in a time that does not depend on where they differ.
bool are_same(const std::string& a, const std::string& b);

}  // namespace hueline::console
