#include "core/calendar.hpp"

#include <fmt/format.h>

#include <array>

namespace hueline {
namespace {

using std::chrono::seconds;

/// Returns the days from 1980-01-06 to a date of the proleptic Gregorian calendar.
constexpr std::int64_t days_since_gps_epoch(int year, int month, int day) {
  using namespace std::chrono;
  const sys_days date = std::chrono::year(year) / std::chrono::month(static_cast<unsigned>(month)) /
                        std::chrono::day(static_cast<unsigned>(day));
  constexpr sys_days epoch = std::chrono::year(1980) / January / 6;
  return (date - epoch).count();
}

struct Leap {
  /// The offset holds from the first day of a month, 00:00 UTC.
  constexpr Leap(int year, int month, int offset)
      : begin_utc_s(days_since_gps_epoch(year, month, 1) * 86400), offset_s(offset) {}
  std::int64_t begin_utc_s;  ///< UTC seconds since the GPS epoch without leap seconds
  int offset_s;              ///< GPS time minus UTC
};
constexpr seconds kUnixOfGpsEpoch{315'964'800};
constexpr std::array<Leap, 18> kLeaps{{{1981, 7, 1},
                                       {1982, 7, 2},
                                       {1983, 7, 3},
                                       {1985, 7, 4},
                                       {1988, 1, 5},
                                       {1990, 1, 6},
                                       {1991, 1, 7},
                                       {1992, 7, 8},
                                       {1993, 7, 9},
                                       {1994, 7, 10},
                                       {1996, 1, 11},
                                       {1997, 7, 12},
                                       {1999, 1, 13},
                                       {2006, 1, 14},
                                       {2009, 1, 15},
                                       {2012, 7, 16},
                                       {2015, 7, 17},
                                       {2017, 1, 18}}};

}  // namespace

GpsWeekTime to_gps_week(GpsTime t) {
  const std::int64_t week_ns = kSecondsPerWeek * 1'000'000'000;
  std::int64_t ns = count_ns(t);
  std::int64_t week = ns / week_ns;
  if (ns % week_ns < 0) --week;
  return {static_cast<int>(week), nanoseconds(ns - week * week_ns)};
}

int day_of_year(const UtcTime& utc) {
  return static_cast<int>(days_since_gps_epoch(utc.year, utc.month, utc.day) - days_since_gps_epoch(utc.year, 1, 1)) +
         1;
}

seconds utc_offset_from_table(GpsTime t) {
  const auto gps_s = std::chrono::floor<seconds>(t.time_since_epoch()).count();
  int offset = 0;
  for (const Leap& leap : kLeaps)
    if (gps_s >= leap.begin_utc_s + leap.offset_s) offset = leap.offset_s;
  return seconds(offset);
}

std::optional<GpsTime> from_utc(const UtcTime& utc, std::optional<seconds> utc_offset) {
  using namespace std::chrono;
  const year_month_day date{year(utc.year), month(static_cast<unsigned>(utc.month)),
                            day(static_cast<unsigned>(utc.day))};
  if (!date.ok() || utc.hour < 0 || utc.hour > 23 || utc.minute < 0 || utc.minute > 59 || utc.second < 0 ||
      utc.second > 60 || utc.nanosecond < 0 || utc.nanosecond > 999'999'999 || utc.year < 1980 || utc.year > 2200)
    return {};
  const std::int64_t day_s = days_since_gps_epoch(utc.year, utc.month, utc.day) * 86400;
  int offset = 0;
  for (const Leap& leap : kLeaps)
    if (day_s >= leap.begin_utc_s) offset = leap.offset_s;
  if (utc_offset) offset = static_cast<int>(utc_offset->count());
  return GpsTime(seconds(day_s + utc.hour * 3600 + utc.minute * 60 + utc.second + offset) +
                 nanoseconds(utc.nanosecond));
}

UtcTime to_utc(GpsTime t) {
  using namespace std::chrono;
  const seconds whole = floor<seconds>(t.time_since_epoch());
  const auto fraction = t.time_since_epoch() - whole;
  const auto offset = utc_offset_from_table(t);
  // Inside a leap second the table still gives the old offset, so the calendar already shows the next day. The leap
  // second is second 60 of the day before.
  const bool in_leap = utc_offset_from_table(t + seconds(1)) > offset;
  const seconds utc_s = whole - offset - seconds(in_leap ? 1 : 0);
  constexpr sys_days epoch = std::chrono::year(1980) / January / 6;
  const sys_days date = epoch + floor<days>(utc_s);
  const year_month_day ymd(date);
  const auto in_day = utc_s - floor<days>(utc_s);
  UtcTime out;
  out.year = static_cast<int>(ymd.year());
  out.month = static_cast<int>(static_cast<unsigned>(ymd.month()));
  out.day = static_cast<int>(static_cast<unsigned>(ymd.day()));
  out.hour = static_cast<int>(in_day.count() / 3600);
  out.minute = static_cast<int>(in_day.count() / 60 % 60);
  out.second = static_cast<int>(in_day.count() % 60) + (in_leap ? 1 : 0);
  out.nanosecond = static_cast<std::int32_t>(fraction.count());
  return out;
}

GpsTime from_unix(UnixTime t, std::optional<seconds> utc_offset) {
  const GpsTime without_leaps{t.time_since_epoch() - kUnixOfGpsEpoch};
  if (utc_offset) return without_leaps + *utc_offset;
  // The added second makes the first second after a leap second differ from the leap second itself.
  return without_leaps + utc_offset_from_table(without_leaps + utc_offset_from_table(without_leaps) + seconds(1));
}

UnixTime to_unix(GpsTime t, std::optional<seconds> utc_offset) {
  return UnixTime(t.time_since_epoch() + kUnixOfGpsEpoch - utc_offset.value_or(utc_offset_from_table(t)));
}

UnixTime unix_of_tai(nanoseconds since_1970) {
  // In 1980 TAI was 19 s ahead of UTC, and GPS time began as UTC.
  constexpr seconds kTaiMinusGps(19);
  return to_unix(GpsTime(since_1970 - kUnixOfGpsEpoch - kTaiMinusGps));
}

std::string iso_utc(GpsTime t) {
  const UtcTime u = to_utc(t);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", u.year, u.month, u.day, u.hour, u.minute, u.second,
                     u.nanosecond / 1'000'000);
}

}  // namespace hueline
