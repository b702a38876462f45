#pragma once

#include <cstdint>
#include <stop_token>

namespace hueline::sim {

/// Now on CLOCK_MONOTONIC_RAW, ns: the clock that the program's HostTime counts on the same machine.
std::int64_t monotonic_raw_ns();

/// Ties drive time to CLOCK_MONOTONIC_RAW. Immutable; thread-safe.
class DriveClock {
 public:
  /// Drive time 0 falls on `host_begin_ns`; the drive runs `speed` times as fast as the clock.
  DriveClock(std::int64_t host_begin_ns, double speed) : host_begin_ns_(host_begin_ns), speed_(speed) {}

  /// CLOCK_MONOTONIC_RAW of a drive time. Exact at speed 1.
  std::int64_t host_ns(std::int64_t drive_ns) const;

  /// Sleeps until a drive time. False if stopped before. CLOCK_MONOTONIC_RAW cannot be slept on: the sleep is on
  /// CLOCK_MONOTONIC in pieces of at most 50 ms, in which its slew (500 ppm at most) makes 25 us.
  bool sleep_until(std::int64_t drive_ns, const std::stop_token& stop) const;

 private:
  std::int64_t host_begin_ns_;
  double speed_;
};

}  // namespace hueline::sim
