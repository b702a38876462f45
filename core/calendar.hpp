#pragma once

#include <optional>
#include <string>

#include "core/time.hpp"

/// GPS weeks, UTC and leap seconds: they exist at the edges (decoders, reports, file headers) and nowhere else.
namespace hueline {

constexpr std::int64_t kSecondsPerWeek = 604800;

/// GPS week (full, not modulo 1024) and time within it, [0, 7 days).
struct GpsWeekTime {
  int week = 0;
  nanoseconds time_of_week{0};
};

constexpr GpsTime from_gps_week(int week, nanoseconds time_of_week) {
  return GpsTime(std::chrono::seconds(kSecondsPerWeek * week) + time_of_week);
}
GpsWeekTime to_gps_week(GpsTime t);

/// A calendar instant of UTC. `second` may be 60 inside a leap second.
struct UtcTime {
  int year = 1980, month = 1, day = 6, hour = 0, minute = 0, second = 0;
  std::int32_t nanosecond = 0;
  bool operator==(const UtcTime&) const = default;
};

/// GPS minus UTC in whole seconds at a GPS instant, from the built-in table of leap seconds (IERS Bulletin C; last
/// entry 2017-01-01: 18 s). Receivers that report an offset outrank it; a difference is for sync/ to judge.
std::chrono::seconds utc_offset_from_table(GpsTime t);

/// UTC calendar -> GPS time. Uses `utc_offset` if the receiver gave one, else the table. Empty if a field is out of
/// range.
std::optional<GpsTime> from_utc(const UtcTime& utc, std::optional<std::chrono::seconds> utc_offset = {});
UtcTime to_utc(GpsTime t);

/// Unix time <-> GPS time, likewise. A leap second has the Unix time of the second behind it.
GpsTime from_unix(UnixTime t, std::optional<std::chrono::seconds> utc_offset = {});
UnixTime to_unix(GpsTime t, std::optional<std::chrono::seconds> utc_offset = {});

/// ISO 8601 in UTC with milliseconds, for people: "2026-03-01T12:34:56.789Z".
std::string iso_utc(GpsTime t);

}  // namespace hueline
