#pragma once

#include <cstdint>

#include "sim/drive.hpp"

/// The simulator's own calendar, written apart from the program's so that a shared mistake cannot hide.
namespace hueline::sim {

/// GPS minus UTC since 2017-01-01 (IERS Bulletin C). Simulated drives lie after that date.
constexpr std::int64_t kGpsMinusUtcSeconds = 18;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

struct UtcFields {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
  std::int64_t nanosecond = 0;
};

/// UTC calendar fields of a GPS instant.
UtcFields utc_fields(GpsNs gps_ns);

/// Whole microseconds past the running UTC hour, [0, 3.6e9): what a Velodyne locked to PPS and GPRMC counts.
std::uint32_t microseconds_past_utc_hour(GpsNs gps_ns);

/// GPS week, full (not modulo 1024), and what has passed of it.
struct WeekTime {
  std::uint32_t week = 0;
  std::int64_t time_of_week_ns = 0;
};
WeekTime week_time(GpsNs gps_ns);

}  // namespace hueline::sim
