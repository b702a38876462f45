#include "console/server/sessions.hpp"

#include <algorithm>
#include <utility>

namespace hueline::console {

std::string Sessions::begin(const User& user, Clock::time_point now) {
  while (sessions_.size() >= kMost)
    sessions_.erase(std::ranges::min_element(sessions_, {}, [](const auto& one) { return one.second.last_used; }));
  std::string secret = random_text(32);
  sessions_[secret] = {user.name, user.role, random_text(16), user.password_hash, now};
  return secret;
}

const Session* Sessions::find(const std::string& secret, Clock::time_point now) {
  const auto found = sessions_.find(secret);
  if (found == sessions_.end()) return nullptr;
  if (now - found->second.last_used > kIdle) {
    sessions_.erase(found);
    return nullptr;
  }
  found->second.last_used = now;
  return &found->second;
}

int LoginLimit::wait_s(const std::string& address, Clock::time_point now) {
  constexpr auto kSpan = std::chrono::minutes(1);
  constexpr std::size_t kMostOfOne = 5, kMostOfAll = 30;
  while (!failures_.empty() && now - failures_.front().first >= kSpan) failures_.pop_front();
  const auto of_one = std::ranges::count_if(failures_, [&](const auto& one) { return one.second == address; });
  if (static_cast<std::size_t>(of_one) < kMostOfOne && failures_.size() < kMostOfAll) return 0;
  const auto first = failures_.size() >= kMostOfAll
                         ? failures_.begin()
                         : std::ranges::find_if(failures_, [&](const auto& one) { return one.second == address; });
  return 1 + static_cast<int>(std::chrono::duration_cast<std::chrono::seconds>(kSpan - (now - first->first)).count());
}

}  // namespace hueline::console
