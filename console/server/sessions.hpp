#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <string>
#include <utility>

#include "console/server/users.hpp"

namespace hueline::console {

/// Somebody who has logged in.
struct Session {
  std::string name;
  Role role = Role::Viewer;
  std::string csrf;           ///< must come back in a header with each request that changes something
  std::string password_hash;  ///< of the password with which the session has begun
  std::chrono::steady_clock::time_point last_used{};
};

/// The sessions, by the secret in their cookie. They are in memory only: a restart asks for the password again.
/// Thread safety: none.
class Sessions {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 100;  ///< the least recently used one goes first
  static constexpr auto kIdle = std::chrono::hours(12);

  /// Begins a session and returns its secret.
  std::string begin(const User& user, Clock::time_point now);
  /// Returns the session of the secret, or null. The pointer is valid until the next call.
  const Session* find(const std::string& secret, Clock::time_point now);
  void end(const std::string& secret) { sessions_.erase(secret); }

 private:
  std::map<std::string, Session> sessions_;
};

/// Limits how often passwords can be tried: five wrong ones a minute from one address, and thirty from all.
/// Thread safety: none.
class LoginLimit {
 public:
  using Clock = std::chrono::steady_clock;
  /// Returns after how many seconds the address may try again; 0: now.
  int wait_s(const std::string& address, Clock::time_point now);
  void note_failure(const std::string& address, Clock::time_point now) { failures_.emplace_back(now, address); }

 private:
  std::deque<std::pair<Clock::time_point, std::string>> failures_;  // of the last minute
};

}  // namespace hueline::console
