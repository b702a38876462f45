#include "drivers/can/can_cycle.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hueline::drivers {
namespace {

constexpr std::size_t kFewest = 16;
constexpr double kNearPeriod = 0.25;   // in periods: largest deviation of an interval that belongs to the cycle
constexpr double kMostlyNear = 0.75;   // share of such intervals in a message with a cycle
constexpr double kMostCounted = 1e12;  // messages; limits what a wrong clock can give
constexpr double kShortestGap = 1.6;   // in periods: a shorter interval comes from a message that waited on its way
constexpr double kLongestHaste = 0.8;  // in periods: what comes sooner behind another waited less than that one

}  // namespace

std::optional<double> CanCycle::period_s() const {
  const std::size_t known = std::min(count_, intervals_ns_.size());
  if (known < kFewest) return {};
  auto sorted = intervals_ns_;
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(known),
             middle = sorted.begin() + static_cast<std::ptrdiff_t>(known / 2);
  std::nth_element(sorted.begin(), middle, end);
  const auto median = static_cast<double>(*middle);
  double sum = 0, near = 0;
  for (auto interval = sorted.begin(); interval != end; ++interval) {
    if (std::abs(static_cast<double>(*interval) - median) > kNearPeriod * median) continue;
    sum += static_cast<double>(*interval);
    ++near;
  }
  if (median <= 0 || near < kMostlyNear * static_cast<double>(known)) return {};
  return sum / near * 1e-9;  // the mean, because what one message waits longer, the next one waits less
}

CanCycle::Gap CanCycle::take(HostTime received) {
  const std::optional<HostTime> before = std::exchange(last_, received);
  if (!before) return {};
  const auto interval = received - *before;
  const std::optional<double> period = period_s();
  intervals_ns_[count_++ % intervals_ns_.size()] = interval.count();
  if (!period) return {};
  const double periods = std::min(kMostCounted, to_seconds(interval) / *period);
  if (periods < kLongestHaste) {
    awaited_ -= 1 - periods;
    return {};
  }
  Gap gap{.before = 0, .missing = settle()};
  if (periods >= kShortestGap) {
    awaited_ = periods - 1;
    gap.before = std::llround(awaited_);
  }
  return gap;
}

std::int64_t CanCycle::settle() { return std::max<std::int64_t>(0, std::llround(std::exchange(awaited_, 0))); }

}  // namespace hueline::drivers
