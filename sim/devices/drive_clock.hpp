#pragma once

#include <cstdint>
#include <stop_token>

namespace hueline::sim {

/// Returns the time on CLOCK_MONOTONIC_RAW, ns: the clock that the program's HostTime counts on the same machine.
std::int64_t monotonic_raw_ns();

/// Relates drive time to CLOCK_MONOTONIC_RAW. Immutable; thread-safe.
class DriveClock {
 public:
  /// Drive time 0 is at `host_begin_ns`; drive time runs `speed` times as fast as the clock.
  DriveClock(std::int64_t host_begin_ns, double speed) : host_begin_ns_(host_begin_ns), speed_(speed) {}

  /// Returns the CLOCK_MONOTONIC_RAW of a drive time. Exact at speed 1.
  std::int64_t host_ns(std::int64_t drive_ns) const;

  /// Sleeps until a drive time. Returns false if it was stopped before. A thread cannot sleep on CLOCK_MONOTONIC_RAW,
  /// so the function sleeps on CLOCK_MONOTONIC in pieces of at most 50 ms; its slew (500 ppm at most) adds up to 25 us
  /// in a piece.
  bool sleep_until(std::int64_t drive_ns, const std::stop_token& stop) const;

 private:
  std::int64_t host_begin_ns_;
  double speed_;
};

}  // namespace hueline::sim
