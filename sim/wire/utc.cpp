#include "sim/wire/utc.hpp"

namespace hueline::sim {
namespace {

constexpr std::int64_t kSecondsPerDay = 86400;
constexpr std::int64_t kNsPerHour = 3600 * kNsPerSecond;
constexpr std::int64_t kNsPerWeek = 7 * kSecondsPerDay * kNsPerSecond;

bool is_leap_year(int year) { return (year % 4 == 0 && year % 100 != 0) || year % 400 == 0; }

int days_of_month(int year, int month) {
  constexpr int kDays[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  return month == 2 && is_leap_year(year) ? 29 : kDays[month - 1];
}

}  // namespace

UtcFields utc_fields(GpsNs gps_ns) {
  const std::int64_t utc_ns = gps_ns - kGpsMinusUtcSeconds * kNsPerSecond;
  std::int64_t days = utc_ns / (kSecondsPerDay * kNsPerSecond);
  std::int64_t rest = utc_ns % (kSecondsPerDay * kNsPerSecond);

  UtcFields utc;
  utc.year = 1980;
  utc.month = 1;
  days += 5;  // the epoch is 6 January; count from 1 January
  for (; days >= (is_leap_year(utc.year) ? 366 : 365); ++utc.year) days -= is_leap_year(utc.year) ? 366 : 365;
  for (; days >= days_of_month(utc.year, utc.month); ++utc.month) days -= days_of_month(utc.year, utc.month);
  utc.day = static_cast<int>(days) + 1;

  utc.nanosecond = rest % kNsPerSecond;
  rest /= kNsPerSecond;
  utc.hour = static_cast<int>(rest / 3600);
  utc.minute = static_cast<int>(rest / 60 % 60);
  utc.second = static_cast<int>(rest % 60);
  return utc;
}

std::uint32_t microseconds_past_utc_hour(GpsNs gps_ns) {
  return static_cast<std::uint32_t>((gps_ns - kGpsMinusUtcSeconds * kNsPerSecond) % kNsPerHour / 1000);
}

WeekTime week_time(GpsNs gps_ns) { return {static_cast<std::uint32_t>(gps_ns / kNsPerWeek), gps_ns % kNsPerWeek}; }

}  // namespace hueline::sim
