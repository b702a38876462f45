#pragma once

#include <fmt/format.h>

#include <string>

#include "core/calendar.hpp"

namespace hueline {

/// Formats a time for tables: ISO 8601 in UTC with microseconds, "2026-03-01T12:34:56.789012Z".
inline std::string utc_text(GpsTime time) {
  const UtcTime utc = to_utc(time);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:06}Z", utc.year, utc.month, utc.day, utc.hour, utc.minute,
                     utc.second, utc.nanosecond / 1000);
}

}  // namespace hueline
