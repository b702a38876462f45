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

/// $xxRMC: the whole UTC second that the GNSS receiver named, and whether it trusted its fix.
struct RmcSentence {
  UtcTime utc;             ///< `nanosecond` holds the fraction that the sentence has
  bool is_active = false;  ///< status 'A'
};

/// A sentence from '$' to its checksum; what follows is not looked at. Errors: Malformed (form, checksum, field),
/// Unsupported (well-formed, but not RMC), Truncated. Reentrant.
Result<RmcSentence> decode_rmc(std::string_view text);

/// A position packet (512 bytes, port 8308): VLP-16 User Manual, section 9.3.3.
struct VelodynePosition {
  std::uint32_t hour_us = 0;  ///< microseconds past the UTC hour when the packet was assembled
  PulseStatus pps;
  std::string_view
      nmea;  ///< the receiver's sentence as echoed, up to its line end; points into the packet; may be empty
};

/// Errors: Malformed (size, counter beyond the hour).
Result<VelodynePosition> decode_position(std::span<const std::byte> bytes);

/// The GPS second of the latest PPS edge at the packet's assembly. The sentence is 10-700 ms late and is echoed until
/// the next one comes, so its second is that of an earlier edge in the first part of each second; the scanner's own
/// counter is not late. `lag` is how many whole seconds the counter is ahead of the sentence: 0 or 1 when all is well.
struct PositionSecond {
  GpsTime second{};
  std::int64_t lag = 0;
};
std::optional<PositionSecond> second_of_latest_edge(const UtcTime& rmc, std::uint32_t hour_us);

}  // namespace hueline::drivers
