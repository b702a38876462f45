#pragma once

#include <optional>
#include <string>

#include "core/time.hpp"

/// GPS weeks, UTC and leap seconds. They are used only where data enter and leave the program: in decoders, reports and
/// file headers.
namespace hueline {

constexpr std::int64_t kSecondsPerWeek = 604800;

/// The GPS week in full, not modulo 1024, and the time within it, in [0, 7 days).
struct GpsWeekTime {
  int week = 0;
  nanoseconds time_of_week{0};
};

constexpr GpsTime from_gps_week(int week, nanoseconds time_of_week) {
  return GpsTime(std::chrono::seconds(kSecondsPerWeek * week) + time_of_week);
}
GpsWeekTime to_gps_week(GpsTime t);

/// A UTC date and time. `second` is 60 inside a leap second.
struct UtcTime {
  int year = 1980, month = 1, day = 6, hour = 0, minute = 0, second = 0;
  std::int32_t nanosecond = 0;
  bool operator==(const UtcTime&) const = default;
};

/// Returns 1 for 1 January.
int day_of_year(const UtcTime& utc);

/// Returns GPS time minus UTC in whole seconds at `t`, from the built-in table of leap seconds (IERS Bulletin C; last
/// entry 2017-01-01: 18 s). An offset that a receiver reports has precedence; sync/ judges a difference between the
/// two.
std::chrono::seconds utc_offset_from_table(GpsTime t);

/// Converts a UTC date to GPS time, with `utc_offset` if the receiver gave one, otherwise with the table. Returns
/// nothing if a field is out of range.
std::optional<GpsTime> from_utc(const UtcTime& utc, std::optional<std::chrono::seconds> utc_offset = {});
/// Converts GPS time to a UTC date, with the table.
UtcTime to_utc(GpsTime t);

/// Convert between Unix time and GPS time, with `utc_offset` if the receiver gave one, otherwise with the table. A leap
/// second has the same Unix time as the second after it.
GpsTime from_unix(UnixTime t, std::optional<std::chrono::seconds> utc_offset = {});
UnixTime to_unix(GpsTime t, std::optional<std::chrono::seconds> utc_offset = {});

/// Converts time since 1970-01-01 on the scale of TAI, as clocks that follow PTP count it: without leap seconds, and
/// 19 s ahead of GPS time.
UnixTime unix_of_tai(nanoseconds since_1970);

/// Formats `t` for people: ISO 8601 in UTC with milliseconds, "2026-03-01T12:34:56.789Z".
std::string iso_utc(GpsTime t);

}  // namespace hueline
