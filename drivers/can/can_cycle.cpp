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
constexpr int kSettledAfter = 8;       // messages in a row that come at their time
constexpr double kNothing = 0.5;       // in periods: less is no message
constexpr int kLongestWait = 32;       // messages, and those that are waited for

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
  const std::optional<double> period = wait_ ? wait_->period_s : period_s();
  const double periods = period ? std::min(kMostCounted, to_seconds(interval) / *period) : 1;
  Gap gap;
  if (periods >= kShortestGap) gap.before = std::llround(periods - 1);
  if (!wait_) {
    if (period) gap.missing = 0;
    if (gap.before > 0)
      wait_ = {.period_s = *period, .count = periods - 1, .on_time = 0, .left = gap.before + kLongestWait};
    else
      intervals_ns_[count_++ % intervals_ns_.size()] = interval.count();
    return gap;
  }
  wait_->count = std::min(kMostCounted, wait_->count + periods - 1);
  wait_->on_time = periods < kLongestHaste || gap.before > 0 ? 0 : wait_->on_time + 1;
  const bool is_other_period = --wait_->left == 0;
  if (is_other_period) count_ = 0;
  if (is_other_period || wait_->on_time == kSettledAfter || wait_->count < kNothing) gap.missing = settle();
  return gap;
}

std::int64_t CanCycle::settle() {
  const std::optional<Wait> wait = std::exchange(wait_, {});
  return wait && wait->count >= kNothing ? std::llround(wait->count) : 0;
}

}  // namespace hueline::drivers
