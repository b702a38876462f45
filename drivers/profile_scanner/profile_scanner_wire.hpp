#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"
#include "drivers/pulse_status.hpp"

/// The generic wire format of profile scanners. One UDP datagram is one message, little endian; docs/formats.md,
/// "Profile scanner", gives the reasons.
///
///   every datagram
///   offset  size  field
///        0     4  magic 0x31465250, the characters "PRF1"
///        4     1  version, 1
///        5     1  kind: 1 data, 2 status
///        6     2  number of the scanner
///        8     4  counter of the scanner's datagrams of this kind; wraps
///       12     2  length of the datagram, bytes
///       14     1  time scale, ProfileTimeScale
///       15     1  0
///       16     4  second, by the scanner's clock
///       20     4  nanosecond within the second
///
///   data, after the above
///       24     4  line, turns of the mirror until the first pulse; wraps
///       28     4  mirror angle at the first pulse, 2^-32 turns
///       32     4  angle from pulse to pulse, signed, 2^-32 turns
///       36     4  time from pulse to pulse, ps
///       40     2  number of pulses n
///       42     2  number of returns m
///       44     n  number of returns of each pulse, 0 to 15
///     44+n    6m  returns: range, 4 bytes, 0.1 mm; reflectance, 2 bytes, 0.01 %
///
///   status, after the first 24 bytes
///       24     1  PPS status (pulse_status.hpp)
///       25     1  bit 0: a receiver named the seconds; bit 1: its fix was valid
///       26     2  0
///       28     4  second of the latest PPS edge
///
/// The functions check the fields.
/// Thread safety: they may be called from several threads at the same time.
namespace hueline::drivers {

constexpr std::uint32_t kProfileMagic = 0x31465250;  ///< "PRF1"
constexpr std::uint8_t kProfileVersion = 1;
constexpr std::size_t kProfileHeaderBytes = 24;
constexpr std::size_t kProfileDataBytes = 44;    ///< size before the table of pulses
constexpr std::size_t kProfileStatusBytes = 32;  ///< size of the whole datagram
constexpr std::size_t kProfileReturnBytes = 6;

enum class ProfileKind : std::uint8_t { Data = 1, Status = 2 };
/// The time scale of a datagram's seconds.
enum class ProfileTimeScale : std::uint8_t {
  Gps = 0,   ///< seconds since 1980-01-06T00:00:00 UTC, without leap seconds
  Utc = 1,   ///< Unix time: seconds since 1970-01-01T00:00:00 UTC, leap seconds not counted
  None = 2,  ///< seconds since power-up, if the scanner was not told the time
};

/// The fields of every datagram.
struct ProfileHeader {
  ProfileKind kind = ProfileKind::Data;
  std::uint16_t scanner = 0;
  std::uint32_t counter = 0;  ///< of datagrams of this kind
  ProfileTimeScale scale = ProfileTimeScale::Gps;
  std::uint32_t second = 0, nanosecond = 0;  ///< data: emission of the first pulse; status: time of sending
};

/// The fields of a data datagram after those of every datagram.
struct ProfileData {
  std::uint32_t line = 0;             ///< turn of the mirror in which the first pulse was emitted
  std::uint32_t angle = 0;            ///< of the mirror at the first pulse, 2^-32 turns
  std::int32_t angle_step = 0;        ///< from pulse to pulse, 2^-32 turns
  std::uint32_t period_ps = 0;        ///< from pulse to pulse
  std::span<const std::byte> counts;  ///< one byte for each pulse: the number of its returns
  /// The returns, 6 bytes each: u32 range (0.1 mm), u16 reflectance (0.01 %). Their number is the sum of `counts`.
  std::span<const std::byte> returns;
};

/// The fields of a status datagram after those of every datagram.
struct ProfileStatus {
  PulseStatus pps;
  bool has_label = false;         ///< whether a receiver's message named the seconds
  bool is_label_valid = false;    ///< whether that receiver trusted its fix
  std::uint32_t edge_second = 0;  ///< second of the latest PPS edge, on the time scale of the header
};

/// Returns whether a datagram begins like this format (magic, and room for a header). Use it to tell formats apart.
bool is_profile_datagram(std::span<const std::byte> datagram);
/// Decodes the fields of every datagram. Errors: Malformed (magic, length, kind, a field out of its range), Truncated
/// (shorter than it says), Unsupported (another version).
Result<ProfileHeader> decode_profile_header(std::span<const std::byte> datagram);
/// Decode the rest of a datagram whose header was decoded. Error: Malformed.
Result<ProfileData> decode_profile_data(std::span<const std::byte> datagram);
Result<ProfileStatus> decode_profile_status(std::span<const std::byte> datagram);

}  // namespace hueline::drivers
