#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/calendar.hpp"
#include "core/result.hpp"
#include "drivers/pulse_status.hpp"

namespace hueline::drivers {

/// The content of an $xxRMC sentence: the UTC second that the GNSS receiver named, and whether it trusted its fix.
struct RmcSentence {
  UtcTime utc;             ///< `nanosecond` is the fraction in the sentence
  bool is_active = false;  ///< whether the status is 'A'
};

/// Decodes a sentence from its '$' to its checksum, and ignores what follows. Errors: Malformed (form, checksum,
/// field), Unsupported (a sound sentence that is not RMC), Truncated.
/// Thread safety: may be called from several threads at the same time.
Result<RmcSentence> decode_rmc(std::string_view text);

/// The content of a position packet (UDP port 8308). Source: VLP-16 User Manual, section 9.3.3. 512 bytes, little
/// endian:
///
///   offset  size  field
///      198     4  time, microseconds past the UTC hour
///      202     1  PPS status (pulse_status.hpp)
///      206   128  NMEA sentence of the GNSS receiver, up to its line end or a zero byte
///
/// The other bytes are not read.
struct VelodynePosition {
  std::uint32_t hour_us = 0;  ///< time at which the packet was assembled, microseconds past the UTC hour
  PulseStatus pps;
  /// The sentence that the scanner repeats, up to its line end. It points into the packet. It may be empty.
  std::string_view nmea;
};

/// Decodes a position packet. A counter beyond the hour is taken for one of the next. Errors: Malformed (size).
Result<VelodynePosition> decode_position(std::span<const std::byte> bytes);

/// The GPS second of the latest PPS edge when a position packet was assembled. The RMC sentence comes 10-700 ms late
/// and is repeated until the next one comes. So in the first part of each second it names the second of an earlier
/// edge. The scanner's own counter is not late. `lag` says by how many whole seconds the counter is ahead of the
/// sentence; 0 and 1 are normal.
struct PositionSecond {
  GpsTime second{};
  std::int64_t lag = 0;
};
/// Computes the second of the latest edge from the sentence and the scanner's counter. Returns nothing if the
/// sentence's date or time is impossible.
std::optional<PositionSecond> second_of_latest_edge(const UtcTime& rmc, std::uint32_t hour_us);

}  // namespace hueline::drivers
