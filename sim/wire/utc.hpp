#pragma once

#include <cstdint>

#include "sim/drive.hpp"

/// The simulator's own calendar. It is written separately from the program's, so that the two cannot share a mistake.
namespace hueline::sim {

/// GPS time minus UTC since 2017-01-01 (IERS Bulletin C). Simulated drives are later than that date.
constexpr std::int64_t kGpsMinusUtcSeconds = 18;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

/// A UTC date and time.
struct UtcFields {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
  std::int64_t nanosecond = 0;
};

/// Returns the UTC calendar fields of a GPS time.
UtcFields utc_fields(GpsNs gps_ns);

/// Returns whole microseconds since the last full UTC hour, [0, 3.6e9). A Velodyne that is locked to PPS and GPRMC
/// counts them.
std::uint32_t microseconds_past_utc_hour(GpsNs gps_ns);

/// The full GPS week (not modulo 1024) and the time since its beginning.
struct WeekTime {
  std::uint32_t week = 0;
  std::int64_t time_of_week_ns = 0;
};
/// Returns week and time of week of a GPS time.
WeekTime week_time(GpsNs gps_ns);

}  // namespace hueline::sim
