#pragma once

#include <cstdint>
#include <variant>

#include "core/time.hpp"

/// How a laser scanner stamps what it sends. A decoder hands over the stamp as the device gives it; sync/ turns it into
/// GpsTime.
namespace hueline {

/// Where the periods of a scanner's counter begin.
enum class CounterOrigin : std::uint8_t {
  Gps,  ///< whole periods since 1980-01-06T00:00:00 UTC; leap seconds are counted (a time of week)
  Utc,  ///< whole periods since 1970-01-01T00:00:00 UTC; leap seconds are not counted (a time of the hour or of the
        ///< day)
  Own,  ///< power-up or anything else: nobody has told the scanner the time
};

/// One reading of a counter that begins anew after each period: microseconds past the hour, seconds of the day, 32 bits
/// of microseconds.
struct LaserCounter {
  CounterOrigin origin = CounterOrigin::Own;
  nanoseconds period{std::chrono::hours(
      1)};               ///< above 0; at least twice as long as arrivals or labels may be wrong, or it tells nothing
  nanoseconds value{0};  ///< since the period began; [0, period)
  bool operator==(const LaserCounter&) const = default;
  /// Both are readings of one counter, so that their difference has a meaning.
  bool is_same_clock(const LaserCounter& other) const { return origin == other.origin && period == other.period; }
};

/// A scanner's stamp: a reading of its counter, or an absolute time on one of the two scales that devices know.
using LaserTime = std::variant<LaserCounter, GpsTime, UnixTime>;

}  // namespace hueline
