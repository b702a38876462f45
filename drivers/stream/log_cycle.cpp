#include "drivers/stream/log_cycle.hpp"

#include <algorithm>
#include <utility>

namespace hueline::drivers {
namespace {

// Number of equal steps in a row that make a period. An IMU of 125 Hz that is asked for 100 Hz steps by 8, 8, 8, 16 ms.
constexpr int kEqualSteps = 8;
constexpr int kOddSteps = 16;  // so many equal steps in a row, other than the period, are another rate
constexpr std::size_t kMostTrials = 64;
// Messages after a gap before it counts; a datagram that was overtaken can still come meanwhile.
constexpr int kSettled = 4;
constexpr nanoseconds kShortestPeriod = std::chrono::milliseconds(2);  // times are rounded to 1 ms
constexpr nanoseconds kLongestGap = std::chrono::minutes(1);
constexpr std::int64_t kDrift = 10'000;  // the clock of the arrivals drifts by less than 1 / kDrift

}  // namespace

void LogCycle::begin(GpsTime time, HostTime received) {
  settle();
  std::deque<Trial> told = std::move(trials_);
  *this = {};
  trials_ = std::move(told);
  last_ = time;
  earliest_ = received.time_since_epoch() - time.time_since_epoch();
}

bool LogCycle::fills(GpsTime time) {
  for (Trial& trial : trials_) {
    if (time <= trial.gap.before || time >= trial.gap.after) continue;
    if (trial.gap.missing > 0) --trial.gap.missing;
    return true;
  }
  return false;
}

/// Takes a step. Returns how many steps in a row were equal.
int LogCycle::equal_steps(nanoseconds step) {
  equal_ = step == step_ ? std::min(equal_ + 1, std::max(kEqualSteps, kOddSteps)) : 1;
  step_ = step;
  return equal_;
}

std::optional<LogCycle::Gap> LogCycle::take(GpsTime time, HostTime received) {
  if (!last_) {
    begin(time, received);
    return {};
  }
  const nanoseconds step = time - *last_;
  if (step <= nanoseconds(0)) {
    if (!fills(time)) begin(time, received);
    return {};
  }
  const nanoseconds delay = received.time_since_epoch() - time.time_since_epoch();
  const bool is_early = delay < earliest_ - (period_ ? *period_ / 2 : nanoseconds(0));
  earliest_ = std::min(earliest_ + step / kDrift, delay);
  const int equal = equal_steps(step);
  std::optional<Gap> gap;
  if (!period_) {
    if (equal >= kEqualSteps && step >= kShortestPeriod) period_ = step;
  } else if (step == *period_) {
    for (Trial& trial : trials_) trial.is_confirmed = true;
  } else if (step % *period_ != nanoseconds(0) || step > kLongestGap || is_early || equal >= kOddSteps ||
             trials_.size() == kMostTrials) {
    begin(time, received);
    return {};
  } else {
    gap = Gap{*last_, time, static_cast<std::uint64_t>(step / *period_ - 1)};
  }
  for (Trial& trial : trials_) ++trial.followed;
  if (gap) trials_.push_back({.gap = *gap});
  last_ = time;
  return gap;
}

void LogCycle::excuse(std::uint64_t logs) {
  if (!trials_.empty()) trials_.back().gap.missing -= std::min(trials_.back().gap.missing, logs);
}

std::optional<LogCycle::Gap> LogCycle::settled() {
  while (!trials_.empty() && trials_.front().is_confirmed && trials_.front().followed >= kSettled) {
    const Gap gap = trials_.front().gap;
    trials_.pop_front();
    if (gap.missing > 0) return gap;
  }
  return {};
}

void LogCycle::finish() {
  for (Trial& trial : trials_) trial.is_confirmed = trial.is_confirmed || trial.followed == 0;
  settle();
}

void LogCycle::settle() {
  for (Trial& trial : trials_) {
    trial.followed = kSettled;
  }
  std::erase_if(trials_, [](const Trial& trial) { return !trial.is_confirmed; });
}

}  // namespace hueline::drivers
