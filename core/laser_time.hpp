#pragma once

#include <cstdint>
#include <variant>

#include "core/time.hpp"

/// How a laser scanner stamps what it sends. A decoder passes on the stamp as the device gives it; sync/ converts it to
/// GpsTime.
namespace hueline {

/// Where the periods of a scanner's counter begin.
enum class CounterOrigin : std::uint8_t {
  /// Periods are counted from 1980-01-06T00:00:00 UTC, leap seconds included. Example: the time of week.
  Gps,
  /// Periods are counted from 1970-01-01T00:00:00 UTC, leap seconds not included. Examples: the time of the hour, of
  /// the day.
  Utc,
  /// At power-up or at any other event: the scanner has no absolute time.
  Own,
};

/// A reading of a counter that starts again after each period. Examples: microseconds past the hour, seconds of the
/// day, 32 bits of microseconds.
struct LaserCounter {
  CounterOrigin origin = CounterOrigin::Own;
  /// Length of a period, above 0. It must be at least twice the possible error of arrivals and labels; otherwise they
  /// cannot tell which period it is.
  nanoseconds period{std::chrono::hours(1)};
  nanoseconds value{0};  ///< time since the period began, in [0, period)
  bool operator==(const LaserCounter&) const = default;
  /// Returns true if both are readings of the same kind of counter, so that their difference has a meaning.
  bool is_same_clock(const LaserCounter& other) const { return origin == other.origin && period == other.period; }
};

/// A scanner's stamp: a reading of its counter, or an absolute time on one of the two scales that devices use.
using LaserTime = std::variant<LaserCounter, GpsTime, UnixTime>;

}  // namespace hueline
