#include "sim/devices/drive_clock.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>

namespace hueline::sim {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kLongestSleepNs = 50'000'000;

std::int64_t clock_ns(clockid_t clock) {
  timespec t{};
  ::clock_gettime(clock, &t);
  return t.tv_sec * kNsPerSecond + t.tv_nsec;
}

}  // namespace

std::int64_t monotonic_raw_ns() { return clock_ns(CLOCK_MONOTONIC_RAW); }

std::int64_t DriveClock::host_ns(std::int64_t drive_ns) const {
  if (speed_ == 1.0) return host_begin_ns_ + drive_ns;
  return host_begin_ns_ + std::llround(static_cast<double>(drive_ns) / speed_);
}

bool DriveClock::sleep_until(std::int64_t drive_ns, const std::stop_token& stop) const {
  const std::int64_t target = host_ns(drive_ns);
  while (!stop.stop_requested()) {
    const std::int64_t left = target - monotonic_raw_ns();
    if (left <= 0) return true;
    const std::int64_t until = clock_ns(CLOCK_MONOTONIC) + std::min(left, kLongestSleepNs);
    const timespec t{until / kNsPerSecond, until % kNsPerSecond};
    ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
  }
  return false;
}

}  // namespace hueline::sim
