#include "survey/some_moments.hpp"

#include <algorithm>

namespace hueline::survey {
namespace {
constexpr std::size_t kRemembered = 64;  // far more moments than one camera is behind another
}

bool SomeMoments::chooses(GpsTime mid) {
  for (const auto& [time, is_chosen] : recent_)
    if (std::chrono::abs(mid - time) < together_) return is_chosen;
  const bool is_chosen =
      count_++ % static_cast<std::uint64_t>(every_) == static_cast<std::uint64_t>(std::min(2, every_ - 1));
  recent_.emplace_back(mid, is_chosen);
  if (recent_.size() > kRemembered) recent_.pop_front();
  return is_chosen;
}

}  // namespace hueline::survey
